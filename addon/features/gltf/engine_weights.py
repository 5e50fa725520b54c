# SPDX-License-Identifier: GPL-3.0-or-later
"""Has exporters write the weights by which Blender deforms, where they would write others: they also take
groups of bones that do not deform. Vertices without weights stay in glTF; in USD they go to the skeleton's
origin, and in FBX where each program puts them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext

import bpy
import numpy as np

from ...attach import properties
from ...base.names import NEUTRAL
from ...deform import characters, session
from ...io import mesh_io
from ...skinning.influences import entries_of_bones, owners_of
from ..bake import bake_state, helper_bones_io


def prepare(meshes: Sequence[bpy.types.Object], kind: str) -> list[str]:
    """Changes the groups of meshes that Sinew deforms; may give their armatures a bone that stays still.
    Returns a sentence for each mesh that can not be changed.

    kind  the ending of the file
    """
    found, left_out = [], []
    for obj, state in session.deformed_now(meshes, bpy.context.evaluated_depsgraph_get()):
        replaced = properties.of(obj).replaced_modifiers
        if len(replaced) == 1 and state.shown.frames[0] is not None:
            rig = replaced[0].armature
            rows, unmoved = _rows(obj, rig, kind in (".usdc", ".fbx"))
            if rows and (reason := _reason(obj, rig)):
                left_out.append(
                    f"{obj.name}: the file moves {len(rows)} vertices otherwise, as they have no weights of "
                    f"bones that deform: {reason}"
                )
            elif rows:
                found.append((obj, rig, rows, unmoved))
    still_bones: dict[bpy.types.Object, str] = {}
    for obj, rig, rows, unmoved in found:
        if obj.data.users > 1 or obj.data.library is not None:
            bake_state.use_copy_of_mesh(obj)
        if unmoved:
            if rig not in still_bones:
                still_bones[rig] = _still_bone(rig)
            group = obj.vertex_groups.new(name=still_bones[rig]).index
            rows |= {vertex: {**rows[vertex], group: 1.0} for vertex in unmoved}
        mesh_io.write_group_weights(obj, rows)
    if found:
        session.refresh(bpy.context)
    return left_out


def _reason(obj: bpy.types.Object, rig: bpy.types.Object) -> str:
    """Why they can not be changed; empty where they can."""
    for each in (obj, rig):
        if each.library is not None or each.override_library is not None:
            return f"{each.name} is linked; make it local"
    return "" if rig.name in bpy.context.view_layer.objects else f"{rig.name} is not in this view layer"


def _rows(
    obj: bpy.types.Object, rig: bpy.types.Object, of_unmoved: bool
) -> tuple[dict[int, dict[int, float]], list[int]]:
    """For each vertex that exporters would move otherwise, the groups that it keeps; and which of these no
    bone moves, where they are asked for and the mesh has others."""
    groups = mesh_io.read_group_weights(obj.data)
    deforms = {bone.name: bone.use_deform for bone in rig.data.bones}
    of_group = np.array([deforms.get(group.name, -1) for group in obj.vertex_groups], dtype=np.int32)
    vertices, kinds = (
        owners_of(groups.counts),
        np.append(of_group, -1)[np.minimum(groups.groups, len(of_group))],
    )
    others = np.unique(vertices[(kinds == 0) & (groups.weights > 0.0)]).tolist()
    counts = entries_of_bones(groups, np.where(of_group == 1, 0, -1)).influences().counts
    is_unmoved = (counts == 0) & of_unmoved & bool(counts.any())
    unmoved = np.flatnonzero(is_unmoved).tolist()
    starts = np.cumsum(groups.counts) - groups.counts
    rows = {}
    for vertex in {*others, *unmoved}:
        own = range(starts[vertex], starts[vertex] + groups.counts[vertex])
        kept = [entry for entry in own if kinds[entry] != 0 and groups.groups[entry] < len(of_group)]
        rows[vertex] = {int(groups.groups[entry]): float(groups.weights[entry]) for entry in kept}
    return rows, unmoved


def _still_bone(rig: bpy.types.Object) -> str:
    """Makes it. Returns its name."""
    if rig.data.library is not None:
        helper_bones_io.use_copy_of_armature(rig)
    first = rig.data.bones[0].name
    with nullcontext() if rig.visible_get() else characters.shown([rig]):
        made = helper_bones_io.add_bones(rig, [first], np.zeros((1, 3)), False, NEUTRAL, np.identity(4)[None])
    return made[0]
