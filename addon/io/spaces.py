# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes between the spaces of the world, of objects and of bones' channels. Armature space is that of an
armature object. Matrices are named target_from_source."""

from collections.abc import Iterable

import bpy
import numpy as np
from mathutils import Matrix

from ..skinning.vectors import SAME_SPACE

# Before, a mesh object with a scale of 0 had no inverse, and Blender moved all its vertices to its origin.
_MESH_HAS_INVERSE = bpy.app.version >= (5, 0)


def bones_from_model(
    evaluated_mesh: bpy.types.Object, evaluated_armature: bpy.types.Object
) -> np.ndarray | None:
    """Returns float64 [4, 4], from the mesh object's space to armature space; None where there is none, as a
    scale is 0, not finite or too large."""
    mesh_world, armature_world = evaluated_mesh.matrix_world, evaluated_armature.matrix_world
    if not armature_world.determinant():
        return None
    if mesh_world == armature_world:
        return SAME_SPACE
    mesh, armature = _read(mesh_world), _read(armature_world)
    if not (is_usable(mesh) and is_usable(armature)):
        return None
    if mesh_world.determinant():
        space = np.linalg.inv(armature) @ mesh
    elif _MESH_HAS_INVERSE:
        space = np.linalg.inv(model_from_bones(evaluated_mesh, evaluated_armature))
    else:
        return None
    return space if is_usable(space) else None


def bones_from_model_in(
    depsgraph: bpy.types.Depsgraph, obj: bpy.types.Object, armature: bpy.types.Object
) -> np.ndarray | None:
    """The same for two objects as this depsgraph has evaluated them."""
    return bones_from_model(obj.evaluated_get(depsgraph), armature.evaluated_get(depsgraph))


def is_usable(matrix: np.ndarray) -> bool:
    """Whether products with other matrices are finite in float32. Blender stores infinity as the largest
    number."""
    return bool((np.abs(matrix) < 1e38).all())


def model_from_bones(evaluated_mesh: bpy.types.Object, evaluated_armature: bpy.types.Object) -> np.ndarray:
    """Returns float64 [4, 4], from armature space to the mesh object's, as Blender has it where a scale is
    0."""
    mesh_world, armature_world = evaluated_mesh.matrix_world, _read(evaluated_armature.matrix_world)
    if not (mesh_world.determinant() or _MESH_HAS_INVERSE):
        return np.zeros((4, 4))
    return _read(mesh_world.inverted_safe()) @ armature_world


def bones_from_object(evaluated_armature: bpy.types.Object, evaluated: bpy.types.Object) -> Matrix:
    """Returns the matrix from another object's space to armature space."""
    return evaluated_armature.matrix_world.inverted_safe() @ evaluated.matrix_world


def scale_of(obj: bpy.types.Object) -> float:
    """Returns how many units of the world one of the object is: of unequal scales the geometric mean. 1 where
    a scale is 0 or not finite."""
    volume = abs(obj.matrix_world.determinant())
    return float(volume ** (1 / 3)) if 0.0 < volume < np.inf else 1.0


def up_of(armature: bpy.types.Object) -> np.ndarray:
    """Returns [3]: the world's Z in armature space, of length 1."""
    up = np.array(armature.matrix_world.to_3x3().normalized().inverted_safe(), dtype=np.float64)[:, 2]
    length = float(np.linalg.norm(up))
    return up / length if length > 0.0 else np.array([0.0, 0.0, 1.0])


def channels_from_poses(
    bone: bpy.types.Bone, poses: Iterable[np.ndarray], parent_poses: Iterable[np.ndarray]
) -> list[Matrix]:
    """Returns what a bone's channels have to give for each pose, whatever the bone inherits.

    poses, parent_poses  [4, 4] each, armature space: of the bone and of its parent, which is ignored where it
                         has none
    """
    found = []
    for pose, parent in zip(poses, parent_poses, strict=True):
        above = {}
        if bone.parent is not None:
            above = {"parent_matrix": Matrix(parent), "parent_matrix_local": bone.parent.matrix_local}
        found.append(bone.convert_local_to_pose(Matrix(pose), bone.matrix_local, invert=True, **above))
    return found


def _read(matrix: Matrix) -> np.ndarray:
    return np.array(matrix, dtype=np.float64)
