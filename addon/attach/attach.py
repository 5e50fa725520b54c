# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts Sinew in the place of an object's Armature modifiers, and takes it off again.

While Sinew deforms, the Armature modifiers stay in the stack, as the artist switched them, where other tools
look for them; in_depsgraph.py has Blender leave them out. In a saved file they deform, and Sinew's modifier
is off, so that a Blender without Sinew can play it.
"""

from collections.abc import Collection
from typing import TypeAlias

import bpy

from ..base.errors import SinewError
from ..base.phrases import phrase
from ..io.actions import animated_paths, is_animated
from . import (
    baked,
    corrective_smooth,
    layout,
    modifier_types,
    point_store,
    pose_driver,
    properties,
    property_groups,
    setting_animation,
    stack,
    stage_settings,
    stored_vertex_data,
    undeformed,
    upstream_proxy,
)
from .icons import ICONS, Deformer
from .layout import Layout, method_of
from .property_groups import assign
from .stack import armature_modifier, sinew_modifier
from .subscribers import notify, subscribers
from .updates import updates_suspended

# The methods between which an Armature modifier's Preserve Volume chooses.
MODIFIERS_OWN = ("lbs", "dq")

# Armature modifiers that Sinew replaces, in their order, each with what Sinew stores about it.
Replaced: TypeAlias = list[tuple[bpy.types.ArmatureModifier, properties.SinewReplacedModifier]]


def armature_of(obj: bpy.types.Object) -> bpy.types.Object | None:
    """Returns the armature that deforms a mesh object: by its first Armature modifier, whose armature Sinew
    keeps, or as its parent. Reads the stack as it is now; Sinew's record follows at the next event, and
    never while the mesh is hidden."""
    if obj.type != "MESH":
        return None
    modifier = armature_modifier(obj)
    # An undo can have the object in its own modifier.
    if modifier is not None and modifier.object not in (None, obj):
        return modifier.object
    if properties.has_sinew(obj):
        kept = properties.of(obj).replaced_modifiers
        same = (each for each in kept if modifier is not None and stack.modifier_of(obj, each) == modifier)
        found = next(same, None) or next(iter(kept), None)
        if found is not None and found.armature is not None:
            return found.armature
    return obj.parent if modifier is None and layout.parent_deforms(obj) else None


def deformed_meshes(objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Returns those of `objects` that are meshes deformed by an armature, or that have Sinew, without a
    comparison's copies."""
    return [
        o
        for o in objects
        if o.type == "MESH"
        and not properties.is_helper(o)
        and not properties.is_copy(o)
        and (properties.has_sinew(o) or armature_of(o) is not None)
    ]


def not_meshes(objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Returns those of `objects` that an armature deforms and that Sinew leaves to Blender, such as
    lattices."""
    return [
        o for o in objects if o.type != "MESH" and any(m.type == "ARMATURE" and m.object for m in o.modifiers)
    ]


def check_can_add(obj: bpy.types.Object) -> None:
    """Raises SinewError that says why Sinew cannot deform a mesh object, and what to do."""
    if armature_of(obj) is None:
        raise SinewError(f"{obj.name}: no Armature modifier with an armature; parent the mesh to one first")
    if not obj.is_editable:
        raise SinewError(
            f"{obj.name} is linked from another file; make a library override of it first "
            "(Object > Library Override > Make)"
        )
    if obj.mode == "EDIT":
        raise SinewError(f"{obj.name} is in edit mode; leave it first")
    check_stack(obj)


def check_stack(obj: bpy.types.Object, left_out: Collection[str] = ()) -> None:
    """Raises SinewError where an object's other modifiers, without types of `left_out`, do not permit
    Sinew's."""
    now = layout.read(obj)
    upstream_proxy.check(obj, now)
    check_behind(obj, now, left_out)


def check_behind(obj: bpy.types.Object, now: Layout, left_out: Collection[str] = ()) -> None:
    """Raises SinewError where a modifier behind, without types of `left_out`, does not permit Sinew's."""
    for modifier in now.behind:
        if modifier.kind in modifier_types.NEED_ORIGINAL_MESH.difference(left_out):
            raise SinewError(
                f"{obj.name}: in front of {modifier.name} Blender permits only modifiers that just deform, "
                "so not Sinew's; move it in front of the Armature modifier, or apply or remove it"
            )


def add(obj: bpy.types.Object, method: str | None = None, is_shown: bool = True) -> None:
    """Puts Sinew on an object. It deforms after the next session.refresh(). Without `method`, each Armature
    modifier keeps its own method.

    is_shown  it deforms also where the Armature modifiers are off in both views

    Raises SinewError, and changes nothing, where that is not possible.
    """
    if properties.has_sinew(obj):
        if method is not None:
            # For all Armature modifiers.
            properties.of(obj).method = method
        return
    check_can_add(obj)
    with updates_suspended():
        _add(obj, method, is_shown)


def _add(obj: bpy.types.Object, method: str | None, is_shown: bool) -> None:
    active, before = obj.modifiers.active, {modifier.name for modifier in obj.modifiers}
    try:
        _replace_modifiers(obj, method)
        if is_shown and not layout.read(obj).is_visibility_keyed:
            _switch_on_where_off(obj)
    except Exception as error:
        parent_type = properties.of(obj).before.parent_type
        properties.clear(obj)
        for modifier in [m for m in obj.modifiers if m.name not in before]:
            obj.modifiers.remove(modifier)
        if parent_type:
            obj.parent_type = parent_type
        if not isinstance(error, RuntimeError):
            raise
        # Blender refuses an operation with such an error, and gives the reason.
        reason = str(error).strip().removeprefix("Error: ")
        raise SinewError(f"{obj.name}: Sinew can not be added to its modifiers: {reason}") from error
    finally:
        obj.modifiers.active = active


def _replace_modifiers(obj: bpy.types.Object, method: str | None) -> None:
    settings = properties.of(obj)
    if armature_modifier(obj) is None:
        _make_modifier_of_parent(obj)
    run = stack.armature_modifiers(obj)
    nodes = obj.modifiers.new("Sinew", "NODES")
    settings.stack.modifier_uid = nodes.persistent_uid
    nodes.show_expanded = False
    nodes.show_in_editmode = False
    _show(nodes, False, False)
    # Not to the end of the stack, where the artist may have pinned other modifiers.
    stack.move_behind(obj, nodes.name, run[-1].name)
    settings.before.had_animation = obj.animation_data is not None
    settings.method = method or method_of(run[0])
    properties.make_groups(settings)
    stage_settings.note_scale(obj)
    for modifier, replaced in replaced_modifiers(obj):
        replaced.armature = modifier.object
        if method is None and method_of(modifier) != settings.method:
            replaced.method = method_of(modifier)


def _switch_on_where_off(obj: bpy.types.Object) -> None:
    """Switches the Armature modifiers on where they are off in both views, and off what replaces them, such
    as a bake."""
    pairs = replaced_modifiers(obj)
    if any(modifier.show_viewport or modifier.show_render for modifier, _replaced in pairs):
        return
    for modifier, replaced in pairs:
        replaced.was_off = True
        _show(modifier, viewport=True, render=True)
    baked.switch_off(obj)


def notes(obj: bpy.types.Object) -> list[str]:
    """Returns sentences on an animated method, on icons that were set back, on what Add found switched off,
    and on what it switched off itself."""
    found = []
    settings = properties.of(obj)
    is_keyed = any(is_volume_followed(obj, skin) for skin in layout.read(obj).skins)
    if settings.method in MODIFIERS_OWN and is_keyed:
        text = "Its Preserve Volume is animated, and chooses between Linear Blend and Dual Quaternion"
        found.append(phrase(text))
    if undeformed.was_switched(obj):
        text = "Sinew's two helping modifiers follow the icon of its own: switch the modifier Sinew"
        found.append(phrase(text))
    if any(replaced.was_off for replaced in settings.replaced_modifiers):
        text = "Its Armature modifier was off before Sinew; Remove switches it off again"
        found += [phrase(text), *baked.notes(obj)]
    return found


def hangs_on(obj: bpy.types.Object, armatures: Collection[bpy.types.Object]) -> bool:
    """Whether an object is parented to one of the armatures or its bones, or to what is."""
    parent = obj.parent
    while parent is not None and parent not in armatures:
        parent = parent.parent
    return parent is not None


def is_volume_followed(obj: bpy.types.Object, skin: layout.Modifier) -> bool:
    """Whether an animated Preserve Volume decides between the two methods of an Armature modifier itself. A
    copy in a comparison has the method that its label names."""
    return skin.armature.method == "" and not properties.is_copy(obj)


def _make_modifier_of_parent(obj: bpy.types.Object) -> None:
    """Makes a modifier of the parent type Armature, which deforms without a modifier in the stack."""
    modifier = obj.modifiers.new("Armature", "ARMATURE")
    obj.modifiers.move(list(obj.modifiers).index(modifier), 0)
    modifier.object = obj.parent
    modifier.use_bone_envelopes = True
    properties.of(obj).before.parent_type = obj.parent_type
    obj.parent_type = "OBJECT"


def remove(obj: bpy.types.Object) -> None:
    """Takes Sinew off as take_off() does, for the artist.

    Raises SinewError, and changes nothing, where Sinew would be back after loading the file.
    """
    nodes = sinew_modifier(obj)
    if obj.override_library is not None and nodes is not None and nodes.is_override_data:
        # A script can remove it from the override, but then Blender loads it again, and the Armature modifier
        # twice.
        raise SinewError(
            f"{obj.name}: Sinew comes with it from its library; switch it off here, or remove it there"
        )
    take_off(obj)


def take_off(obj: bpy.types.Object, is_by_others: bool = False) -> None:
    """Takes Sinew off: the Armature modifiers are as before, and nothing of Sinew stays in the file.

    is_by_others  somebody removed its modifier
    """
    with updates_suspended():
        _take_off(obj, is_by_others)
    notify(subscribers.after_removal)


def _take_off(obj: bpy.types.Object, is_by_others: bool) -> None:
    switch(obj, on=False)
    restore_volume(obj)
    settings, nodes = properties.of(obj), sinew_modifier(obj)
    for modifier, replaced in replaced_modifiers(obj):
        # What was switched since is the artist's own choice.
        if replaced.was_off and modifier.show_viewport and modifier.show_render:
            _show(modifier, viewport=False, render=False)
    baked.switch_on(obj)
    notify(subscribers.before_removal, obj)
    (undeformed.remove_later if is_by_others else undeformed.remove)(obj)
    if nodes is not None:
        active = obj.modifiers.active if obj.modifiers.active != nodes else armature_modifier(obj)
        obj.modifiers.remove(nodes)
        obj.modifiers.active = active
    if settings.before.parent_type:
        modifier = armature_modifier(obj)
        if modifier is not None:
            obj.modifiers.remove(modifier)
        obj.parent_type = settings.before.parent_type
    point_store.remove(obj)
    if not any(
        other.data == obj.data and properties.has_sinew(other) for other in bpy.data.objects if other != obj
    ):
        stored_vertex_data.remove(obj.data)
    setting_animation.remove(obj)
    properties.clear(obj)


def switch(obj: bpy.types.Object, on: bool, in_depsgraph: bool = False, now: Layout | None = None) -> None:
    """On: Sinew's modifier has the icons that the artist gave it. Off: its icons are off, and the Armature
    modifiers deform by themselves.

    in_depsgraph  Sinew deforms it within Blender's evaluation
    now           the object's layout; None to read it
    """
    settings, now = properties.of(obj), now or layout.read(obj)
    was_on, nodes = settings.replaces_modifiers, obj.modifiers.get(now.sinew)
    if on:
        restore_volume(obj)
        adopt_pointers(obj, now)
    elif was_on:
        restore_pointers(obj, now)
        pose_driver.remove(obj)
    if nodes is not None:
        # In edit mode the Armature modifiers deform.
        assign(nodes, "show_in_editmode", False)
    for view in range(len(ICONS)):
        _switch_own(obj, now, view, on, was_on, in_depsgraph)
    undeformed.mark(obj, on)
    property_groups.store(settings.stack, "replaces_modifiers", on)
    if settings.before.smooth.name:
        smooths = (not on or icons.deformer is Deformer.ARMATURE for icons in layout.read(obj).icons)
        corrective_smooth.switch(obj, *smooths)


def _switch_own(
    obj: bpy.types.Object, now: Layout, view: int, on: bool, was_on: bool, in_depsgraph: bool
) -> None:
    """Switches an icon of Sinew's modifiers, unless an animation does."""
    known, is_shown, is_clicked = properties.of(obj).stack, on, on != was_on
    icon, nodes = ICONS[view], obj.modifiers.get(now.sinew)
    if nodes is not None and not now.by_name[now.sinew].keyed[view]:
        if was_on:
            is_clicked |= getattr(known, icon) != getattr(nodes, icon)
            property_groups.store(known, icon, getattr(nodes, icon))
        is_shown = on and getattr(known, icon)
        assign(nodes, icon, is_shown)
    # Within the evaluation, in_depsgraph.py switches them: a click evaluates the object once.
    is_clicked |= not is_shown
    undeformed.switch(obj, now, icon, on if in_depsgraph else is_shown, is_clicked)


def is_off(obj: bpy.types.Object) -> bool:
    """Whether its modifiers are as they have to be while Sinew is off."""
    settings = properties.of(obj)
    return not (settings.enabled or settings.replaces_modifiers)


def follow_own_icons(obj: bpy.types.Object, now: Layout) -> bool:
    """Takes over that the artist switched Sinew's modifier on where a small mesh is left to Blender. Returns
    whether it was."""
    settings, is_switched = properties.of(obj), False
    is_left = settings.enabled and not settings.replaces_modifiers and obj.library is None
    if not (is_left and now.sinew) or obj.mode in ("EDIT", "SCULPT"):
        return False
    nodes = now.by_name[now.sinew]
    for icon, is_shown, is_keyed in zip(ICONS, nodes.shown, nodes.keyed, strict=True):
        if is_shown and not is_keyed:
            property_groups.store(settings, "leave_small", False)
            property_groups.store(settings.stack, icon, True)
            is_switched = True
    return is_switched


def show(obj: bpy.types.Object) -> None:
    """Has Sinew deform it in both views, whatever was switched before."""
    settings, now = properties.of(obj), layout.read(obj)
    for view, icon in enumerate(ICONS):
        property_groups.store(settings.stack, icon, True)
        if settings.replaces_modifiers and now.sinew and not now.by_name[now.sinew].keyed[view]:
            assign(obj.modifiers[now.sinew], icon, True)
        if now.icons[view].deformer is Deformer.NOTHING:
            for skin in now.skins:
                assign(obj.modifiers[skin.name], icon, True)


def use_nearest_volume(obj: bpy.types.Object) -> None:
    """Sets the Armature modifiers' Preserve Volume to what is nearest to Sinew's method, while they deform:
    in a saved file, and in modes whose tools need them. Set once: what the artist switches meanwhile
    stays."""
    settings = properties.of(obj)
    pairs = replaced_modifiers(obj)
    methods = methods_by_name(settings)
    nearest = [methods[replaced.name] == "dq" for _modifier, replaced in pairs]
    if settings.before.has_nearest_volume:
        before = [replaced.preserve_volume == replaced.was_nearest for _modifier, replaced in pairs]
        if nearest == before:
            return
        # The method has changed since.
        restore_volume(obj)
    for (modifier, replaced), wanted in zip(pairs, nearest, strict=True):
        own = modifier.use_deform_preserve_volume
        if is_animated(obj, modifier, "use_deform_preserve_volume"):
            wanted = own
        property_groups.store(replaced, "preserve_volume", own)
        property_groups.store(replaced, "was_nearest", own == wanted)
        assign(modifier, "use_deform_preserve_volume", wanted)
    property_groups.store(settings.before, "has_nearest_volume", True)


def restore_volume(obj: bpy.types.Object) -> bool:
    """Gives the Armature modifiers the artist's own Preserve Volume again. Returns whether they had another
    one."""
    settings = properties.of(obj)
    if not settings.before.has_nearest_volume:
        return False
    for replaced in settings.replaced_modifiers:
        modifier = stack.modifier_of(obj, replaced)
        # What the artist has switched since stays, too.
        if modifier is not None and not replaced.was_nearest:
            assign(modifier, "use_deform_preserve_volume", replaced.preserve_volume)
    property_groups.store(settings.before, "has_nearest_volume", False)
    return True


def has_switched_volume(obj: bpy.types.Object) -> bool:
    """Whether one of the Armature modifiers has another Preserve Volume than the artist's at the moment."""
    settings = properties.of(obj)
    are_nearest = all(each.was_nearest for each in settings.replaced_modifiers)
    return settings.before.has_nearest_volume and not are_nearest


def _show(modifier: bpy.types.Modifier, viewport: bool, render: bool) -> None:
    assign(modifier, "show_viewport", viewport)
    assign(modifier, "show_render", render)


def replaced_modifiers(obj: bpy.types.Object, now: Layout | None = None) -> Replaced:
    """Returns the Armature modifiers that Sinew replaces, in their order, each with what Sinew stores about
    it, which is made where it is missing.

    now  the object's layout; None to read it
    """
    now, kept = now or layout.read(obj), properties.of(obj).replaced_modifiers
    numbers = [layout.find(now.modifiers, "ARMATURE", each) for each in kept]
    names = [None if number is None else now.modifiers[number].name for number in numbers]
    for name in now.replaced:
        modifier = obj.modifiers[name]
        if name not in names:
            names.append(name)
            made = kept.add()
            made.preserve_volume, made.was_nearest = modifier.use_deform_preserve_volume, True
        replaced = kept[names.index(name)]
        property_groups.store(replaced, "name", name)
        property_groups.store(replaced, "uid", modifier.persistent_uid)
    # Adding one has made Blender move the earlier ones in memory.
    return [(obj.modifiers[name], kept[names.index(name)]) for name in now.replaced]


def follow_stack(obj: bpy.types.Object, now: Layout) -> Layout:
    """Follows the artist's changes of the stack, where modifiers were moved, renamed or deleted. Each
    Armature modifier keeps its method; one that no longer follows the first without a gap deforms by itself
    again. Returns the layout now."""
    settings = properties.of(obj)
    now = stack.position_own(obj, now)
    kept = settings.replaced_modifiers
    names = [replaced.name for _modifier, replaced in replaced_modifiers(obj, now)]
    if [replaced.name for replaced in kept] == names:
        return now
    methods = methods_by_name(settings)
    for name in methods.keys() - set(names):
        modifier = obj.modifiers.get(name)
        if settings.replaces_modifiers and modifier is not None and modifier.type == "ARMATURE":
            _restore_pointer(modifier, kept[name])
        kept.remove(kept.find(name))
    for place, name in enumerate(names):
        kept.move(kept.find(name), place)
    if "sinew.method" not in animated_paths(obj):
        settings.method = methods[names[0]]
    for name, method in methods_by_name(settings).items():
        if method != methods[name]:
            kept[name].method = methods[name]
    return layout.read(obj)


def methods_by_name(settings: properties.SinewSettings) -> dict[str, str]:
    """Returns the method of each Armature modifier that Sinew replaces, by the modifier's name."""
    return dict(zip(settings.replaced_modifiers.keys(), settings.methods, strict=True))


def adopt_pointers(obj: bpy.types.Object, now: Layout) -> None:
    """Takes over armatures that the artist chose in the Armature modifiers."""
    for modifier, replaced in replaced_modifiers(obj, now):
        # An undo can have the object in its own modifier (point_store.clear_references_to_itself).
        if modifier.object not in (None, obj, replaced.armature):
            replaced.armature = modifier.object


def restore_pointers(obj: bpy.types.Object, now: Layout) -> None:
    """Makes the Armature modifiers point to their armatures again."""
    for modifier, replaced in replaced_modifiers(obj, now):
        _restore_pointer(modifier, replaced)


def _restore_pointer(
    modifier: bpy.types.ArmatureModifier, replaced: properties.SinewReplacedModifier
) -> None:
    armature = replaced.armature
    if armature is not None and is_deleted(armature):
        modifier.object = None
    elif modifier.object is None and armature is not None:
        modifier.object = armature


def is_deleted(armature: bpy.types.Object) -> bool:
    """Whether the user deleted it: it is then in no collection, and only Sinew's pointer keeps it in the
    file."""
    return armature.library is None and not armature.users_collection
