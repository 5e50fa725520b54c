# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows what was done to Sinew's modifier: deleted, applied, or copied to another object."""

import logging

import bpy

from ..attach import attach, layout, node_group, point_store, properties, property_groups
from ..attach.icons import ICONS
from ..attach.layout import Layout
from ..base.errors import SinewError
from .plan import Plan, State
from .skinned_object import SkinnedObject

log = logging.getLogger("sinew")


def follow_removal(obj: bpy.types.Object, now: Layout, plan: Plan, skinned: SkinnedObject | None) -> bool:
    """Takes Sinew off an object that has lost Sinew's modifier, or the Armature modifier that deforms in its
    place. Returns whether it has.

    If the modifier was applied or the object converted to a mesh, the mesh has the deformed shape: then the
    replaced Armature modifiers are removed too. If the modifier was deleted, they deform the mesh again.
    """
    # Where Sinew deforms, or an error says that it is gone, the object stays.
    stays = properties.of(obj).replaces_modifiers or plan.state is State.REFUSED
    if obj.data.is_editmode or (now.sinew and (stays or now.replaced)):
        return False
    # The last shape is computed only here, not at each pose.
    rest, shown = (None, None) if skinned is None else (skinned.bound.source.points, skinned.points)
    is_applied = point_store.are_applied(obj, rest, shown)
    applied = now.replaced if is_applied else ()
    attach.take_off(obj, is_by_others=True)
    for name in applied:
        obj.modifiers.remove(obj.modifiers[name])
    if skinned is not None:
        skinned.take_off_normals(obj.data)
    what = "its shape is in its mesh now" if is_applied else "its modifier was deleted"
    log.info("%s: %s, and Sinew is off it", obj.name, what)
    return True


def adopt_copy(obj: bpy.types.Object) -> bool:
    """Handles Sinew's modifier on an object without Sinew's settings, as Copy Modifiers leaves it. The object
    gets Sinew as the original has it, or else only its Armature modifiers.

    Returns whether there was such a modifier.
    """
    now = layout.read(obj) if _is_without_settings(obj) else None
    if now is None or not now.sinew:
        return False
    armatures = [obj.modifiers[m.name] for m in now.modifiers if m.armature is not None]
    origin = _origin_of(obj.modifiers[now.sinew], armatures)
    for name in now.own:
        obj.modifiers.remove(obj.modifiers[name])
    kept = properties.of(origin).replaced_modifiers if origin is not None else {}
    for modifier in armatures:
        replaced = kept.get(modifier.name)
        if replaced is None:
            continue
        if modifier.object is None:
            modifier.object = replaced.armature
    if origin is None or attach.armature_of(obj) is None:
        return True
    try:
        attach.add(obj, properties.of(origin).method, is_shown=False)
    except SinewError as error:
        log.error("%s", error)
        return True
    settings, others = properties.of(obj), properties.of(origin)
    properties.share(origin, obj)
    property_groups.copy(others.before.smooth, settings.before.smooth)
    for icon, icons in zip(ICONS, layout.read(origin).icons, strict=True):
        property_groups.store(settings.stack, icon, icons.sinew)
    for replaced in settings.replaced_modifiers:
        replaced.was_off = replaced.name in kept and kept[replaced.name].was_off
    for replaced in list(settings.replaced_modifiers)[1:]:
        replaced.method = kept[replaced.name].method if replaced.name in kept else properties.SAME_METHOD
    return True


def _is_without_settings(obj: bpy.types.Object) -> bool:
    is_others = properties.has_sinew(obj) or properties.is_helper(obj) or properties.is_copy(obj)
    return obj.type == "MESH" and obj.library is None and not is_others


def _origin_of(
    nodes: bpy.types.NodesModifier, armatures: list[bpy.types.ArmatureModifier]
) -> bpy.types.Object | None:
    """Returns the skinned object that the modifiers were copied from: the one whose point buffer they name;
    else the active one, which Blender's commands copy from; else one with modifiers of the same names and
    armatures."""
    names = {modifier.name for modifier in armatures}
    alike = [
        obj
        for obj in bpy.data.objects
        if properties.has_sinew(obj)
        and names >= {each.name for each in properties.of(obj).replaced_modifiers}
    ]
    buffer = node_group.get_input(nodes, "Points")
    pointed = {modifier.object for modifier in armatures} - {None}

    def likeness(obj: bpy.types.Object) -> tuple[bool, bool, bool]:
        settings = properties.of(obj)
        return (
            settings.storage.point_buffer is not None and settings.storage.point_buffer == buffer,
            obj == bpy.context.view_layer.objects.active,
            pointed <= set(settings.armatures),
        )

    return max(alike, key=likeness, default=None)
