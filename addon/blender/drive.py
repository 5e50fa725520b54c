# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts Sinew in the place of an object's Armature modifier, and takes it away again.

While Sinew is on, the Armature modifier stays in the stack, switched off and without its armature: that
pointer alone makes Blender evaluate the mesh and all behind it twice a frame.
"""

from __future__ import annotations

import bpy

from ..core.errors import SinewError
from . import mesh_io, node_group, pose_driver, properties

ATTRIBUTE = "sinew_points"

# Modifiers that leave positions, topology and weights alone may stand in front of the Armature modifier.
HARMLESS_IN_FRONT = {"NORMAL_EDIT", "UV_PROJECT", "UV_WARP", "WEIGHTED_NORMAL"}


def armature_modifier(obj: bpy.types.Object) -> bpy.types.ArmatureModifier | None:
    """The Armature modifier that Sinew stands in for, or would: the first one with an armature, those that
    are switched off last."""
    if properties.is_driven(obj):
        modifier = obj.modifiers.get(properties.of(obj).armature_modifier)
        if modifier is not None and modifier.type == "ARMATURE":
            return modifier
        # Renamed: ours is the one right behind our own modifier.
        ours = [index for index, m in enumerate(obj.modifiers) if node_group.is_sinew(m)]
        behind = obj.modifiers[ours[0] + 1] if ours and ours[0] + 1 < len(obj.modifiers) else None
        if behind is not None and behind.type == "ARMATURE":
            properties.of(obj).armature_modifier = behind.name
            return behind
        return None
    candidates = [m for m in obj.modifiers if m.type == "ARMATURE" and m.object is not None]
    return min(candidates, key=lambda m: not is_on(m), default=None)


def is_on(modifier: bpy.types.Modifier) -> bool:
    return modifier.show_viewport or modifier.show_render


def sinew_modifier(obj: bpy.types.Object) -> bpy.types.NodesModifier | None:
    """Sinew's own modifier; one that has lost its node group is known by its name."""
    nodes = [m for m in obj.modifiers if m.type == "NODES"]
    lost = (m for m in nodes if m.node_group is None and m.name.startswith("Sinew"))
    return next((m for m in nodes if node_group.is_sinew(m)), None) or next(lost, None)


def armature_of(obj: bpy.types.Object) -> bpy.types.Object | None:
    """The armature that deforms a mesh object, by Sinew or by its first Armature modifier."""
    if obj.type != "MESH":
        return None
    if properties.is_driven(obj) and properties.of(obj).armature is not None:
        return properties.of(obj).armature
    modifier = armature_modifier(obj)
    return modifier.object if modifier is not None else None


def deformed_meshes(objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those of `objects` that are meshes deformed by an armature, or driven by Sinew."""
    return [
        o for o in objects if o.type == "MESH" and (properties.is_driven(o) or armature_of(o) is not None)
    ]


def check_can_add(obj: bpy.types.Object) -> bpy.types.ArmatureModifier:
    """The modifier to stand in for. Raises SinewError that says why not and what to do."""
    modifier = armature_modifier(obj)
    if modifier is None:
        raise SinewError(f"{obj.name}: no Armature modifier with an armature; parent the mesh to one first")
    if not obj.is_editable:
        raise SinewError(f"{obj.name} is linked from another file; make it local first (Object > Relations)")
    if not obj.data.is_editable:
        raise SinewError(
            f"{obj.name}: its mesh {obj.data.name} is linked from another file; make it local first "
            "(Object > Relations)"
        )
    if obj.mode == "EDIT":
        raise SinewError(f"{obj.name} is in edit mode; leave it first")
    if obj.parent_type == "ARMATURE":
        raise SinewError(
            f"{obj.name}: its parent {obj.parent.name} deforms it too (parent type Armature); set its parent "
            "type to Object"
        )
    check_in_front(obj)
    return modifier


def check_in_front(obj: bpy.types.Object) -> None:
    """Raises SinewError where a modifier in front of the Armature modifier changes the mesh."""
    modifier = armature_modifier(obj)
    for other in obj.modifiers:
        if other == modifier:
            break
        if is_on(other) and other.type not in HARMLESS_IN_FRONT and not node_group.is_sinew(other):
            raise SinewError(
                f"{obj.name}: modifier {other.name} stands in front of {modifier.name} and changes the mesh "
                "before it; apply it or move it behind"
            )


def add(obj: bpy.types.Object, method: str | None = None) -> None:
    """Sinew takes over from the Armature modifier, with its method where none is given.

    Raises SinewError, and changes nothing, where that can not be done.
    """
    if properties.is_driven(obj):
        if method is not None:
            properties.of(obj).method = method
        return
    modifier = check_can_add(obj)
    settings = properties.of(obj)
    active = obj.modifiers.active
    nodes = obj.modifiers.new("Sinew", "NODES")
    nodes.node_group = node_group.get_or_make()
    nodes.show_expanded = False
    nodes.show_in_editmode = False
    obj.modifiers.move(len(obj.modifiers) - 1, list(obj.modifiers).index(modifier))
    if active is not None:
        obj.modifiers.active = active
    settings.method = method or ("dq" if modifier.use_deform_preserve_volume else "lbs")
    settings.armature = modifier.object
    settings.armature_modifier = modifier.name
    record_flags(obj)
    settings.attribute = _free_attribute_name(obj)
    node_group.set_attribute_name(nodes, settings.attribute)
    switch(obj, on=True)


def remove(obj: bpy.types.Object) -> None:
    """Takes Sinew off: the Armature modifier is as it was, and nothing of ours stays."""
    switch(obj, on=False)
    nodes = sinew_modifier(obj)
    if nodes is not None:
        active = obj.modifiers.active if obj.modifiers.active != nodes else armature_modifier(obj)
        obj.modifiers.remove(nodes)
        if active is not None:
            obj.modifiers.active = active
    _remove_attributes(obj)
    _remove_animation(obj)
    properties.clear(obj)
    node_group.remove_unused()


def switch(obj: bpy.types.Object, on: bool) -> None:
    """On: Sinew deforms. Off: the Armature modifier does, as it was, and Sinew's modifier rests."""
    settings = properties.of(obj)
    modifier = armature_modifier(obj)
    nodes = sinew_modifier(obj)
    if on:
        if modifier is not None:
            modifier.show_viewport = False
            modifier.show_render = False
        clear_pointer(obj)
    elif modifier is not None:
        give_back(obj)
        modifier.show_viewport = settings.show_viewport
        modifier.show_render = settings.show_render
    if nodes is not None:
        nodes.show_viewport = on and settings.show_viewport
        nodes.show_render = on and settings.show_render


def record_flags(obj: bpy.types.Object) -> None:
    """Notes whether the Armature modifier is shown and rendered, to be given back."""
    settings, modifier = properties.of(obj), armature_modifier(obj)
    if modifier is not None:
        settings.show_viewport, settings.show_render = modifier.show_viewport, modifier.show_render


def adopt_pointer(obj: bpy.types.Object) -> None:
    """Takes over an armature that the artist chose in the Armature modifier."""
    modifier = armature_modifier(obj)
    if modifier is not None and modifier.object not in (None, properties.of(obj).armature):
        properties.of(obj).armature = modifier.object


def clear_pointer(obj: bpy.types.Object) -> None:
    """Clears the Armature modifier's pointer, which the settings keep."""
    adopt_pointer(obj)
    modifier = armature_modifier(obj)
    if modifier is not None and modifier.object is not None:
        modifier.object = None


def give_back_pointer(obj: bpy.types.Object) -> None:
    """The Armature modifier points to its armature again."""
    modifier = armature_modifier(obj)
    if modifier is not None and modifier.object is None:
        modifier.object = properties.of(obj).armature


def give_back(obj: bpy.types.Object) -> None:
    """The Armature modifier points to its armature again, and nothing else of ours does."""
    give_back_pointer(obj)
    pose_driver.remove(obj)


def separate_attributes(objects: list[bpy.types.Object]) -> None:
    """Gives each driven object its own attribute where two share a mesh, as after a linked duplicate."""
    taken: set[tuple[str, str]] = set()
    for obj in objects:
        settings = properties.of(obj)
        key = (obj.data.name_full, settings.attribute)
        if key in taken:
            settings.attribute = _free_attribute_name(obj)
            nodes = sinew_modifier(obj)
            if nodes is not None:
                node_group.set_attribute_name(nodes, settings.attribute)
            key = (obj.data.name_full, settings.attribute)
        taken.add(key)


def _free_attribute_name(obj: bpy.types.Object) -> str:
    used = _attributes_of_others(obj) | {attribute.name for attribute in obj.data.attributes}
    name, number = ATTRIBUTE, 0
    while name in used:
        number += 1
        name = f"{ATTRIBUTE}.{number:03d}"
    return name


def _attributes_of_others(obj: bpy.types.Object) -> set[str]:
    """The attributes that the mesh's other driven users hold their points in."""
    return {
        properties.of(other).attribute
        for other in bpy.data.objects
        if other != obj and properties.is_driven(other) and other.data == obj.data
    }


def _remove_attributes(obj: bpy.types.Object) -> None:
    """Takes all attributes of ours off the mesh but those of its other users: a mesh that was copied with
    its object's settings can have more than one."""
    used = _attributes_of_others(obj)
    for name in [attribute.name for attribute in obj.data.attributes]:
        if name.startswith(ATTRIBUTE) and name not in used:
            mesh_io.remove_points(obj.data, name)


def remove_keys(obj: bpy.types.Object, path: str = "sinew.") -> None:
    """Takes keys of Sinew's settings off the object, unless another object plays the same action."""
    animation = obj.animation_data
    if animation is None:
        return
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    for player in (animation, *strips):
        action = player.action
        if action is None or action.users > 1:
            continue
        removed = 0
        for curves in _curve_lists(player):
            for curve in [c for c in curves if c.data_path.startswith(path)]:
                curves.remove(curve)
                removed += 1
        if removed and player is animation and not any(len(curves) for curves in _curve_lists(player)):
            animation.action = None
            bpy.data.actions.remove(action)


def _remove_animation(obj: bpy.types.Object) -> None:
    """Takes keys and drivers of Sinew's settings off the object, and its animation data if they were all."""
    remove_keys(obj)
    animation = obj.animation_data
    if animation is None:
        return
    for driver in [d for d in animation.drivers if d.data_path.startswith("sinew.")]:
        animation.drivers.remove(driver)
    pose_driver.remove_empty_animation(obj)


def _curve_lists(player: bpy.types.AnimData | bpy.types.NlaStrip) -> list[bpy.types.bpy_prop_collection]:
    """The F-curves that `player` plays: an action's own up to 4.3, those of its slot since 4.4."""
    action = player.action
    slot = getattr(player, "action_slot", None)
    if not hasattr(action, "layers"):
        return [action.fcurves]
    if slot is None:
        return []
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips]
    return [bag.fcurves for bag in bags if bag is not None]
