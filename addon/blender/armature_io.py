# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones and poses from Blender, in Sinew's conventions: row-major matrices, armature space."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.rig import Bones


def read_bones(armature: bpy.types.Object) -> Bones:
    """The rest bones of an armature object, in the order of its pose."""
    bones = armature.data.bones
    deform = np.empty(len(bones), dtype=bool)
    bones.foreach_get("use_deform", deform)
    return Bones(tuple(bone.name for bone in bones), deform, _read_matrices(bones, "matrix_local"))


def rest_changed(armature: bpy.types.Object, known: Bones) -> bool:
    """Whether the rest bones differ from `known` in number or place; cheap enough for every frame."""
    bones = armature.data.bones
    return len(bones) != len(known.names) or not np.array_equal(
        _read_matrices(bones, "matrix_local"), known.rest
    )


def read_pose(evaluated_armature: bpy.types.Object) -> np.ndarray:
    """float32 [bones, 4, 4]: each posed bone in armature space."""
    return _read_matrices(evaluated_armature.pose.bones, "matrix")


def _read_matrices(bones: bpy.types.bpy_prop_collection, name: str) -> np.ndarray:
    flat = np.empty(16 * len(bones), dtype=np.float32)
    bones.foreach_get(name, flat)
    # Blender hands matrices over by columns.
    return flat.reshape(-1, 4, 4).transpose(0, 2, 1)


def bones_from_model(evaluated_mesh: bpy.types.Object, evaluated_armature: bpy.types.Object) -> np.ndarray:
    """float64 [4, 4]: the mesh object's space to armature space."""
    mesh_world = np.array(evaluated_mesh.matrix_world, dtype=np.float64)
    armature_world = np.array(evaluated_armature.matrix_world, dtype=np.float64)
    if np.array_equal(mesh_world, armature_world):
        return np.identity(4)
    return np.linalg.inv(armature_world) @ mesh_world
