# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters for the run in Blender's window, and their shapes by Blender's Armature modifier: plain bpy
and numpy, without Sinew."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Matrix, Quaternion

BONES = 3
# The allowed distance of a vertex from its position by the Armature modifier: characters are 3 units long.
TOLERANCE = 2e-5
# More vertices than in meshes that Sinew leaves to the Armature modifier.
LARGE, SMALL = 12_000, 240


def make_character(name: str, vertices: int, place: tuple[float, float, float]) -> bpy.types.Object:
    """Adds to the open scene a tube along X of three bones, at rest at frame 1, bent and twisted at frame
    20, with an Armature modifier. Its armature is called NAME Rig."""
    armature = _make_armature(f"{name} Rig")
    mesh = bpy.data.meshes.new(name)
    points, faces = _tube(vertices)
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    mesh.shade_smooth()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    for bone in range(BONES):
        group = obj.vertex_groups.new(name=f"bone.{bone}")
        weights = np.maximum(0.0, 1.0 - np.abs(points[:, 0] - (bone + 0.5)))
        # Vertices of a ring have the same weights: one call for each ring.
        for weight in np.unique(weights[weights > 0.0]):
            group.add(np.flatnonzero(weights == weight).tolist(), float(weight), "REPLACE")
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    obj.location = armature.location = place
    return obj


def _tube(vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """float64 [vertices, 3] and int [faces, 4]; a ring has 24 vertices, or 12 of small ones."""
    sides = 24 if vertices >= 1000 else 12
    rings = vertices // sides
    ring, side = np.divmod(np.arange(rings * sides), sides)
    angle = 2.0 * np.pi * side / sides
    points = np.stack([BONES * ring / (rings - 1), 0.25 * np.cos(angle), 0.25 * np.sin(angle)], axis=1)
    points = np.round(points, 4)
    here = np.arange((rings - 1) * sides)
    beside = here - side[: len(here)] + (side[: len(here)] + 1) % sides
    return points, np.stack([here, beside, beside + sides, here + sides], axis=1)


def _make_armature(name: str) -> bpy.types.Object:
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    parent = None
    for index in range(BONES):
        bone = armature.data.edit_bones.new(f"bone.{index}")
        bone.head, bone.tail = (index, 0.0, 0.0), (index + 1.0, 0.0, 0.0)
        bone.parent, bone.use_connect = parent, parent is not None
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    for index, bone in enumerate(armature.pose.bones):
        bone.keyframe_insert("rotation_quaternion", frame=1)
        if index:
            bone.rotation_quaternion = _turn(100.0 / index)
        bone.keyframe_insert("rotation_quaternion", frame=20)
    return armature


def _turn(degrees: float) -> Quaternion:
    angle = math.radians(degrees)
    return Quaternion((1, 0, 0), angle) @ Quaternion((0, 1, 0), 0.8 * angle)


def pose(armature: bpy.types.Object, degrees: float, bone: int = 1) -> None:
    """As by hand, without a key."""
    armature.pose.bones[bone].rotation_quaternion = _turn(degrees)


def shown_points(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """float32 [vertices, 3]: the mesh as it was evaluated last."""
    mesh = obj.evaluated_get(depsgraph).data
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    return points


def blender_points(
    obj: bpy.types.Object, armature: bpy.types.Object, method: str, depsgraph: bpy.types.Depsgraph
) -> np.ndarray:
    """float64 [vertices, 3]: the mesh deformed by the formula of an Armature modifier, with Preserve
    Volume if the method is dq; without scaled bones."""
    posed = armature.evaluated_get(depsgraph)
    moves = {
        bone.name: np.array(bone.matrix @ bone.bone.matrix_local.inverted())
        for bone in posed.pose.bones
        if bone.bone.use_deform
    }
    to_armature = np.array(posed.matrix_world.inverted() @ obj.evaluated_get(depsgraph).matrix_world)
    rest = np.empty((len(obj.data.vertices), 3), dtype=np.float32)
    obj.data.vertices.foreach_get("co", rest.ravel())
    points = rest @ to_armature[:3, :3].T + to_armature[:3, 3]
    groups, weights = _influences(obj)
    # A group without a bone has the last index, which stands for none.
    number = {name: index for index, name in enumerate(moves)}
    bone_of = np.array([number.get(group.name, len(moves)) for group in obj.vertex_groups] or [0])
    bones = bone_of[groups]
    weights = np.where(bones < len(moves), weights, 0.0)
    matrices = np.array([*moves.values(), np.eye(4)])
    blend = _dual_quaternion if method == "dq" else _linear
    moved = blend(points, bones, weights, matrices)
    total = weights.sum(axis=1)
    moved = np.where((total > 1e-4)[:, None], moved, points)
    back = np.linalg.inv(to_armature)
    return moved @ back[:3, :3].T + back[:3, 3]


def _influences(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Groups and weights, int and float64 [vertices, influences], for each vertex in stored order."""
    stored = [[(group.group, group.weight) for group in vertex.groups] for vertex in obj.data.vertices]
    most = max(map(len, stored), default=0)
    padded = np.array([one + [(0, 0.0)] * (most - len(one)) for one in stored]).reshape(-1, most, 2)
    return padded[:, :, 0].astype(int), padded[:, :, 1]


def _linear(points: np.ndarray, bones: np.ndarray, weights: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    total = np.maximum(weights.sum(axis=1), 1e-9)
    blended = np.einsum("vi,vijk->vjk", weights, matrices[bones]) / total[:, None, None]
    return np.einsum("vjk,vk->vj", blended[:, :3, :3], points) + blended[:, :3, 3]


def _dual_quaternion(
    points: np.ndarray, bones: np.ndarray, weights: np.ndarray, matrices: np.ndarray
) -> np.ndarray:
    turns = [Matrix(matrix[:3, :3].tolist()).to_quaternion() for matrix in matrices]
    halves = [
        0.5 * np.array(Quaternion((0.0, *matrix[:3, 3])) @ turn)
        for matrix, turn in zip(matrices, turns, strict=True)
    ]
    turns, halves = np.array(turns), np.array(halves)
    real, dual = np.zeros((len(points), 4)), np.zeros((len(points), 4))
    for influence in range(weights.shape[1]):
        turn, half = turns[bones[:, influence]], halves[bones[:, influence]]
        # In the hemisphere of the sum of those before it.
        signed = np.where((real * turn).sum(axis=1) < 0.0, -1.0, 1.0) * weights[:, influence]
        real += signed[:, None] * turn
        dual += signed[:, None] * half
    length = np.maximum(np.linalg.norm(real, axis=1), 1e-9)[:, None]
    real, dual = real / length, dual / length
    w, v, dw, dv = real[:, :1], real[:, 1:], dual[:, :1], dual[:, 1:]
    turned = points + 2.0 * np.cross(v, np.cross(v, points) + w * points)
    return turned + 2.0 * (w * dv - dw * v + np.cross(v, dv))


def worst(a: np.ndarray, b: np.ndarray) -> float:
    if a.shape != b.shape:
        return math.inf
    distance = float(np.abs(a.astype(np.float64) - b).max())
    return distance if math.isfinite(distance) else math.inf
