# SPDX-License-Identifier: GPL-3.0-or-later
"""Applies a plan to an object: its modifiers, their armature pointers, and the storage of its points."""

from dataclasses import replace

import bpy

from ..attach import (
    attach,
    layout,
    normals,
    point_store,
    pose_driver,
    properties,
    stack,
    upstream_proxy,
)
from ..attach.icons import Deformer
from ..attach.layout import Layout
from ..io import armature_io
from . import safe_mode, small_meshes
from .bound import Bound
from .plan import ARMATURE_MODIFIER_MODES, ObjectFacts, Plan, State


def first_facts(obj: bpy.types.Object, now: Layout, error: str) -> ObjectFacts:
    """Returns the facts by which nothing of an object is read; others do not matter then.

    now    its layout
    error  why Sinew can not deform it; empty where it can
    """
    if attach.is_off(obj):
        return ObjectFacts(enabled=False)
    viewport, render = now.icons
    is_by_sinew = viewport.deformer is render.deformer is Deformer.SINEW
    return ObjectFacts(
        enabled=properties.of(obj).enabled,
        error=error,
        is_linked=obj.library is not None,
        mode=mode_of(obj),
        has_upstream=upstream_proxy.is_needed(obj, now),
        visibility_is_keyed=now.is_visibility_keyed,
        deformed_is_read=now.is_deformed_read,
        is_deforming_body=now.is_deforming_body,
        viewport=viewport.deformer,
        render=render.deformer,
        views_differ=is_by_sinew and viewport.modifiers != render.modifiers,
    )


def all_facts(obj: bpy.types.Object, now: Layout, failure: str, lacks: str) -> ObjectFacts:
    """Returns all facts of an object that is read.

    now      its layout
    failure  the error when Sinew deformed it within Blender's evaluation
    lacks    what its method needs and is not computed yet
    """
    settings, mesh = properties.of(obj), obj.data
    given, reason = normals.given(obj, now)
    return replace(
        first_facts(obj, now, error=""),
        builtin_is_faster=small_meshes.is_builtin_faster(obj, now, normals.kind_of(mesh, given.domain)),
        upstream_changes_weights=upstream_proxy.changes_weights(now),
        mesh_is_shared=mesh.users - mesh.use_fake_user > 1,
        mesh_is_editable=mesh.is_editable,
        is_comparison_copy=properties.is_copy(obj),
        has_heat_map=settings.heat,
        safe_mode=safe_mode.is_on(),
        failure=failure,
        lacks=lacks,
        normals=given,
        normals_reason=reason,
    )


def apply(obj: bpy.types.Object, now: Layout, old: Plan, wanted: Plan) -> None:
    """now: the object's layout

    Raises SinewError where the modifiers before Sinew cannot be evaluated separately.
    """
    if obj.library is not None:
        # Its own file was saved so that its Armature modifier deforms it.
        return
    if wanted.uses_builtin:
        is_given_up = wanted.state in (State.OFF, State.REFUSED)
        is_same = old.state is wanted.state and not properties.of(obj).replaces_modifiers
        # While it is edited, what Sinew stores stays.
        is_off = attach.is_off(obj) and old.state is not State.EDITING
        if is_off or (wanted.state is State.REFUSED and is_same):
            if is_given_up:
                # It was saved while it was on, and Sinew has not deformed it since it was appended.
                attach.restore_volume(obj)
            stack.position_own(obj, now)
            return
        attach.switch(obj, on=False, now=now)
        attach.adopt_pointers(obj, stack.position_own(obj, now))
        if is_given_up:
            point_store.remove_point_attributes(obj)
            upstream_proxy.remove(obj)
        elif obj.mode not in ARMATURE_MODIFIER_MODES:
            point_store.remove(obj)
        is_shown = mode_of(obj) in ARMATURE_MODIFIER_MODES and layout.read(obj).deforms
        if wanted.state is State.EDITING and is_shown and small_meshes.has_builtin_shape(obj):
            attach.use_nearest_volume(obj)
        else:
            attach.restore_volume(obj)
        return
    given, in_renders = wanted.normals.domain, not wanted.normals.are_for_viewport_alone
    now = point_store.ensure(obj, now, wanted.in_buffer, given, in_renders)
    attach.switch(obj, True, wanted.is_in_depsgraph, now)
    attach.restore_pointers(obj, now)


def apply_driver(obj: bpy.types.Object, now: Layout, bound: Bound, wanted: Plan) -> None:
    """Keeps the poses evaluated even where an armature is hidden, and has Blender request the points where
    the plan says so."""
    poses = [
        (replaced.armature, path)
        for (_modifier, replaced), skin in zip(
            attach.replaced_modifiers(obj, now), bound.skin_stack.skins, strict=False
        )
        if replaced.armature is not None
        for path in armature_io.paths_to_wait_for(replaced.armature, skin.deformer.moving_bones)
        # One that moves no vertex collapses all of them where it has no size.
        or [pose_driver.WORLD_MATRIX]
    ]
    pose_driver.ensure(obj, list(dict.fromkeys(poses)), now.sinew if wanted.is_in_depsgraph else "")


def apply_saved(obj: bpy.types.Object, plan: Plan) -> None:
    """Prepares an object for a Blender without Sinew: its Armature modifiers deform, with the shape nearest
    to Sinew's, or where an error prevents Sinew with the same as now. apply_resumed() reverses this."""
    settings = properties.of(obj)
    if not (settings.replaces_modifiers or settings.enabled):
        return
    attach.switch(obj, on=False)
    # What was set for a mode may not be the nearest.
    attach.restore_volume(obj)
    if layout.read(obj).deforms and plan.state is not State.REFUSED:
        attach.use_nearest_volume(obj)


def apply_resumed(obj: bpy.types.Object, was_on: bool) -> None:
    """was_on: Sinew deformed it before it was saved."""
    attach.restore_volume(obj)
    # One that is off was not changed.
    if stack.sinew_modifier(obj) is not None and (was_on or not attach.is_off(obj)):
        attach.switch(obj, was_on)


def mode_of(obj: bpy.types.Object) -> str:
    """Returns its mode. Edit mode counts also where another object with the same mesh is in it."""
    return "EDIT" if obj.data.is_editmode else obj.mode
