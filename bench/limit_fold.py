# SPDX-License-Identifier: GPL-3.0-or-later
"""What a plane in each joint does to folds: python bench/limit_fold.py FILE

FILE has a human whose bones are called as Unreal's. A stage was tried that keeps each vertex on that side of
its joint on which it rests. The sides are those of the plane through the joint whose normal is the mean of
both bones' posed directions. This counts pairs of triangles that cross, before and after. It is not part of
Sinew (docs/methods.md).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import bpy
import numpy as np
import sinew
from sinew_addon.features.suggest.suggest import crossing_triangles

MARGIN = 0.2  # of the distance from the plane at rest: how near to it a vertex may come
JOINTS = {"elbow": ("lowerarm_l", (0.0, -1.0, 0.0)), "knee": ("calf_l", (0.0, 1.0, 0.0))}
DEGREES = 90.0, 120.0, 140.0, 155.0


@dataclass
class Human:
    points: np.ndarray
    triangles: np.ndarray
    weights: np.ndarray  # [vertices, bones], of sum 1
    names: list[str]
    parents: list[int]
    heads: np.ndarray
    tails: np.ndarray

    def bent(self, bone: int, degrees: float, towards: np.ndarray) -> np.ndarray:
        """Motions float32 [bones, 4, 4] where the bone and its parent make this angle."""
        before = unit(self.heads[bone] - self.heads[self.parents[bone]])
        along = unit(self.tails[bone] - self.heads[bone])
        axis, angle = np.cross(before, along), np.arccos(np.clip(before @ along, -1, 1))
        if np.linalg.norm(axis) < 0.15:
            axis, angle = np.cross(along, towards), 0.0
        motion = np.eye(4)
        turn = sinew.quat.from_axis_angle(unit(axis), np.radians(degrees) - angle)
        motion[:3, :3] = sinew.quat.to_rotation_matrix(turn)
        motion[:3, 3] = self.heads[bone] - motion[:3, :3] @ self.heads[bone]
        motions = np.tile(np.eye(4), (len(self.names), 1, 1))
        for child, parent in enumerate(self.parents):
            if parent >= 0:
                motions[child] = motions[parent]
            if child == bone:
                motions[child] = motions[child] @ motion
        return motions.astype(np.float32)

    def deformed(self, method: str, motions: np.ndarray) -> np.ndarray:
        used = self.weights > 0
        offsets = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.int32)
        bones, weights = np.nonzero(used)[1].astype(np.int32), self.weights[used].astype(np.float32)
        deformer = sinew.Deformer(self.points, offsets, bones, weights, method)
        return deformer.deform(motions).astype(float)

    def kept_apart(self, posed: np.ndarray, bone: int, motions: np.ndarray, every: bool) -> np.ndarray:
        """every: also vertices of one of the two bones alone"""
        parent, joint = self.parents[bone], self.heads[bone]
        before, after = unit(joint - self.heads[parent]), unit(self.tails[bone] - joint)
        at_rest = (self.points - joint) @ unit(before + after)
        of_two = self.weights[:, [parent, bone]]
        share = of_two.sum(axis=1) ** 2
        if not every:
            ramp = np.clip(of_two.min(axis=1) / np.maximum(of_two.sum(axis=1), 1e-9) / 0.05, 0, 1)
            share = share * ramp**2 * (3 - 2 * ramp)
        first, second = motions[parent, :3, :3] @ before, motions[bone, :3, :3] @ after
        normal, inwards = unit(first + second), unit(second - first)
        from_joint = posed - (motions[bone, :3, :3] @ joint + motions[bone, :3, 3])
        side = np.where(at_rest < 0, -1.0, 1.0)
        height, least = side * (from_joint @ normal), np.maximum(MARGIN * np.abs(at_rest), 1e-9)
        wanted = np.where(height < least, least**2 / (2 * least - np.minimum(height, least)), height)
        is_inside = from_joint @ inwards > 0
        return posed + (share * side * (wanted - height) * is_inside)[:, None] * normal


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def read(path: str) -> Human:
    bpy.ops.wm.open_mainfile(filepath=path)
    skinned = [obj for obj in bpy.data.objects if obj.type == "MESH" and obj.find_armature()]
    obj = max(skinned, key=lambda each: len(each.data.vertices))
    armature, mesh = obj.find_armature(), obj.data
    bones = armature.data.bones
    space = np.array(armature.matrix_world.inverted() @ obj.matrix_world)
    points = np.array([vertex.co for vertex in mesh.vertices]) @ space[:3, :3].T + space[:3, 3]
    number = {bone.name: index for index, bone in enumerate(bones) if bone.use_deform}
    weights = np.zeros((len(points), len(bones)))
    for vertex in mesh.vertices:
        for entry in vertex.groups:
            name = obj.vertex_groups[entry.group].name
            if name in number:
                weights[vertex.index, number[name]] += entry.weight
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
    mesh.calc_loop_triangles()
    names = [bone.name for bone in bones]
    return Human(
        points.astype(np.float32),
        np.array([triangle.vertices[:] for triangle in mesh.loop_triangles]),
        weights,
        names,
        [names.index(bone.parent.name) if bone.parent else -1 for bone in bones],
        np.array([bone.head_local for bone in bones]),
        np.array([bone.tail_local for bone in bones]),
    )


def main() -> None:
    human = read(sys.argv[1])
    at_rest = crossing_triangles(human.points, human.triangles)
    print("pairs of triangles that cross, without those at rest")
    print(f"{'':20}{'before':>8}{'vertices of both bones':>24}{'of either':>12}")
    for joint, (name, towards) in JOINTS.items():
        bone = human.names.index(name)
        for degrees in DEGREES:
            motions = human.bent(bone, degrees, np.array(towards))
            for method in ("lbs", "dq"):
                posed = human.deformed(method, motions)
                shapes = [posed, *(human.kept_apart(posed, bone, motions, every) for every in (False, True))]
                before, both, either = (len(crossing_triangles(s, human.triangles) - at_rest) for s in shapes)
                print(f"{f'{joint}, {degrees:g}, {method}':20}{before:8}{both:24}{either:12}")


if __name__ == "__main__":
    main()
