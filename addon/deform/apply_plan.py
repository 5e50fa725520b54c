# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings an object in line with its plan: its modifiers, their pointers, and what holds its points."""

from __future__ import annotations

import logging

import bpy
import numpy as np

from ..attach import (
    attach,
    node_group,
    normals,
    point_store,
    properties,
    shared_settings,
    stack,
    upstream_proxy,
)
from ..core.errors import SinewError
from . import safe_mode, small_meshes
from .plan import MODES_OF_THE_MODIFIER, ObjectFacts, Plan, State, plan

log = logging.getLogger("sinew")


def plan_of(obj: bpy.types.Object, failure: str = "", waits_for: str = "") -> Plan:
    """What is to become of a skinned object as it is now.

    failure    what failed when Sinew deformed it within Blender's evaluation
    waits_for  what its method needs and is not computed yet
    """
    return plan(facts_of(obj, failure, waits_for))


def facts_of(obj: bpy.types.Object, failure: str = "", waits_for: str = "") -> ObjectFacts:
    settings, pairs, mesh = properties.of(obj), attach.replaced_modifiers(obj), obj.data
    # While Sinew is off, the modifiers have the flags that it would keep.
    flags = [replaced if settings.replaces_modifiers else modifier for modifier, replaced in pairs]
    gives_normals = normals.are_given(settings)
    domain = normals.domain_of(mesh) if gives_normals else ""
    obstacle = normals.obstacle(obj) if domain else ""
    given = normals.kind_of(mesh, "" if obstacle else domain)
    return ObjectFacts(
        enabled=settings.enabled,
        is_linked=obj.library is not None,
        mode=_mode_of(obj),
        builtin_is_faster=small_meshes.is_builtin_faster(obj, given),
        has_upstream=upstream_proxy.is_needed(obj),
        upstream_changes_weights=upstream_proxy.changes_weights(obj),
        mesh_is_shared=mesh.users - mesh.use_fake_user > 1,
        mesh_is_editable=mesh.is_editable,
        is_comparison_copy=properties.is_copy(obj),
        has_heat_map=settings.heat,
        visibility_is_keyed=stack.visibility_is_animated(obj),
        views_differ=any(each.show_viewport != each.show_render for each in flags),
        safe_mode=safe_mode.is_on(),
        failure=failure,
        waits_for=waits_for,
        gives_normals=gives_normals,
        skins_normals=settings.normals == properties.SKINNED_NORMALS,
        normals_domain=domain,
        normals_obstacle=obstacle,
        normals_for_viewport_alone=bool(domain) and normals.is_for_viewport_alone(obj),
    )


def apply(obj: bpy.types.Object, wanted: Plan) -> None:
    """Raises SinewError where what stands in front can not be evaluated apart."""
    if wanted.uses_builtin:
        attach.switch(obj, on=False)
        attach.keep_out_of_chain(obj)
        attach.adopt_pointers(obj)
        if wanted.state is State.OFF:
            point_store.remove_point_attributes(obj)
        elif obj.mode not in MODES_OF_THE_MODIFIER:
            point_store.remove(obj)
        if wanted.state is State.BUILT_IN and _shows_nearest_volume(obj):
            attach.use_nearest_volume(obj)
        else:
            attach.restore_volume(obj)
        return
    given = wanted.normals
    point_store.ensure(obj, wanted.in_buffer, given.domain, not given.are_for_viewport_alone)
    attach.switch(obj, on=True)
    attach.restore_pointers(obj)


def _mode_of(obj: bpy.types.Object) -> str:
    """That of another object, too, where both have one mesh."""
    return "EDIT" if obj.data.is_editmode else obj.mode


def _shows_nearest_volume(obj: bpy.types.Object) -> bool:
    """Whether it is in a mode in which its Armature modifiers, by Preserve Volume, have the shape that Sinew
    is set to."""
    return _mode_of(obj) in MODES_OF_THE_MODIFIER and small_meshes.has_builtin_shape(obj)


def has_lost_modifier(obj: bpy.types.Object) -> bool:
    """Whether Sinew's modifier, or the one that deforms the mesh meanwhile, is gone."""
    if obj.data.is_editmode:
        return False
    settings = properties.of(obj)
    # One that was switched off because its Armature modifier is gone stays, with the sentence that says so.
    uses_builtin = not (settings.replaces_modifiers or settings.error)
    return stack.sinew_modifier(obj) is None or (uses_builtin and stack.armature_modifier(obj) is None)


def follow_removal(obj: bpy.types.Object, rest: np.ndarray | None, shown: np.ndarray | None) -> None:
    """Takes Sinew off an object that has lost its modifier.

    Applied, or converted to a mesh, its shape is the mesh's own, and the Armature modifiers in whose place
    it stood go as they would have gone; deleted, it gives the mesh back to them.

    rest, shown  float32 [vertices, 3], as the mesh was bound, and its last shape; None where unknown
    """
    if point_store.are_applied(obj, rest, shown):
        applied = [modifier.name for modifier in stack.armature_modifiers(obj)]
        attach.take_off(obj)
        for name in applied:
            obj.modifiers.remove(obj.modifiers[name])
        log.info("%s: its shape is in its mesh now, and Sinew is off it", obj.name)
    else:
        attach.take_off(obj)
        log.info("%s: its modifier was deleted, and Sinew is off it", obj.name)


def adopt_copied_modifier(obj: bpy.types.Object) -> bool:
    """Whether an object had Sinew's modifier without its settings, as Copy Modifiers leaves it. It gets Sinew
    as the object has that it came from, or its Armature modifiers alone."""
    nodes = stack.sinew_modifier(obj)
    if nodes is None:
        return False
    armatures = [modifier for modifier in obj.modifiers if modifier.type == "ARMATURE"]
    origin = _origin_of(nodes, armatures)
    obj.modifiers.remove(nodes)
    kept = properties.of(origin).replaced_modifiers if origin is not None else {}
    for modifier in armatures:
        replaced = kept.get(modifier.name)
        if replaced is None:
            continue
        if modifier.object is None:
            modifier.object = replaced.armature
        # Where Sinew is off, or an animation sets them, they are the artist's own.
        if properties.of(origin).replaces_modifiers and not replaced.visibility_is_keyed:
            modifier.show_viewport, modifier.show_render = replaced.show_viewport, replaced.show_render
    if origin is None or attach.armature_of(obj) is None:
        return True
    try:
        attach.add(obj, properties.of(origin).method)
    except SinewError as error:
        log.error("%s", error)
        return True
    settings = properties.of(obj)
    for name in shared_settings.SHARED:
        shared_settings.assign(settings, name, getattr(properties.of(origin), name))
    groups = (*shared_settings.GROUPS, "replaced_smooth")
    properties.copy_groups(properties.of(origin), settings, groups)
    for replaced in list(settings.replaced_modifiers)[1:]:
        replaced.method = kept[replaced.name].method if replaced.name in kept else properties.SAME_METHOD
    return True


def _origin_of(
    nodes: bpy.types.NodesModifier, armatures: list[bpy.types.ArmatureModifier]
) -> bpy.types.Object | None:
    """The skinned object that the modifiers were copied from: the one whose points they name, else the active
    one, which Blender's own commands copy from, else one with modifiers of these names and armatures."""
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
            settings.point_buffer is not None and settings.point_buffer == buffer,
            obj == bpy.context.view_layer.objects.active,
            pointed <= set(settings.armatures),
        )

    return max(alike, key=likeness, default=None)
