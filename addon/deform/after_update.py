# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew after Blender's evaluation: the points go into an object of the file, and Blender evaluates once
more."""

import time
from collections.abc import Iterable
from dataclasses import replace

import bpy
import numpy as np

from ..attach import layout, point_store, properties
from ..base.errors import SinewError
from ..skinning.skin_stack import NO_STAGES
from . import bound, pose, source
from .changes import Changes
from .skinned_object import SkinnedObject


def deform(
    obj: bpy.types.Object,
    skinned: SkinnedObject,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    is_inspected: bool,
    is_first: bool,
) -> None:
    """Writes the points of this evaluation for the next one, where they differ from those stored.

    is_inspected  the object itself may have changed, and with it the storage of its points
    is_first      the object was not deformed after the last update, or is deformed from other data: the
                  stored points or normals are not valid
    """
    # Binding is not part of a frame's time: it happens once.
    started = time.perf_counter()
    differs = shape(obj, skinned, depsgraph)
    shown = skinned.shown
    count = len(shown.rest_points) + skinned.normal_count
    # A view layer that is shown again may have other points.
    is_known = changes.complete and not is_inspected
    is_stored = is_known or point_store.are_written(obj, depsgraph, count)
    if differs or is_first or not is_stored:
        _store(obj, skinned)
    if differs or is_first:
        skinned.shown = replace(shown, milliseconds=1000.0 * (time.perf_counter() - started))


def _store(obj: bpy.types.Object, skinned: SkinnedObject) -> None:
    points, normals = skinned.bound.skin_stack.points, np.empty((skinned.normal_count, 3), dtype=np.float32)
    if len(normals):
        skinned.bound.write_normals(points, skinned.shown.rest_points, skinned.plan.normals, normals)
    point_store.write(obj, points, skinned.bound.source.points, normals)


def shape(obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph) -> bool:
    """Computes the skin stack's points for this evaluation. Returns whether they differ from the last."""
    replaced_modifiers = properties.of(obj).replaced_modifiers
    armatures = [each.armature and each.armature.evaluated_get(depsgraph) for each in replaced_modifiers]
    evaluated = obj.evaluated_get(depsgraph)
    settings = properties.of(evaluated)
    if _names(settings.replaced_modifiers) != _names(replaced_modifiers):
        # Sinew was added, or modifiers were moved, since Blender evaluated the object: animated
        # settings are available only after the next evaluation.
        settings = properties.of(obj)
    modifiers = list(zip(settings.replaced_modifiers, armatures, strict=False))
    icons = pose.icons_of(evaluated, modifiers, skinned)
    frames = pose.read(evaluated, settings, modifiers, skinned, icons, depsgraph.mode)
    rest_points = source.rest_points(obj, skinned.bound.source, depsgraph)
    # In a view in which nothing deforms, Sinew's modifier shows what it gets.
    is_deformed = any(icons[depsgraph.mode == "RENDER"].modifiers)
    values = pose.stage_values(settings) if is_deformed else NO_STAGES
    differs = skinned.bound.skin_stack.deform(rest_points, frames, values=values)
    number = skinned.shown.number + differs
    skinned.shown = replace(
        skinned.shown, frames=frames, rest_points=rest_points, stage_values=values, number=number
    )
    return differs


def _names(replaced_modifiers: Iterable[properties.SinewReplacedModifier]) -> list[str]:
    return [each.name for each in replaced_modifiers]


def bring_up_to_date(obj: bpy.types.Object, skinned: SkinnedObject, depsgraph: bpy.types.Depsgraph) -> None:
    """Updates what is known of a mesh that its Armature modifiers deform to this evaluation, for measuring or
    baking it; other meshes are up to date. Changes nothing in Blender.

    Raises SinewError where the mesh cannot be deformed, or not yet.
    """
    if not skinned.plan.uses_builtin:
        return
    if not source.is_ready(obj, depsgraph):
        raise SinewError(f"{obj.name}: Blender has not evaluated what is in front of Sinew yet")
    now = layout.read(obj)
    if skinned.noted.are_options_keyed and bound.is_of_other_modifiers(obj, now, skinned.bound, depsgraph):
        skinned.bind(bound.read(obj, depsgraph, now))
    if skinned.needs_recheck:
        changes = Changes(meshes={obj.data.session_uid})
        if source.has_changed(obj, skinned.bound.source, depsgraph, changes, touched=False):
            skinned.bind(bound.read(obj, depsgraph, now, skinned.bound))
        skinned.needs_recheck = False
    with skinned.lock:
        shape(obj, skinned, depsgraph)
