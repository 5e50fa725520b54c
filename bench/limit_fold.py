# SPDX-License-Identifier: GPL-3.0-or-later
"""What a plane in each joint does to folds: python bench/limit_fold.py FILE

FILE has a human whose bones are called as Unreal's; a tube is bent beside it. A stage was tried that keeps
each vertex on that side of its joint on which it rests. The sides are those of the plane through the joint
whose normal is the mean of both bones' posed directions. This counts pairs of triangles that cross, before
and after, and in frames of the action those that no plane of a joint can part. It is not part of Sinew
(docs/methods.md).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
import sinew
from sinew_addon.features.measure import battery
from sinew_addon.features.measure.crossings import crossing_triangles
from sinew_addon.io import armature_io, mesh_io
from sinew_addon.skinning.rig import Bones
from sinew_addon.skinning.vectors import transformed

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))
from rigs import influences
from tube import Tube

MARGIN = 0.2  # of the distance from the plane at rest: how near to it a vertex may come
JOINTS = {"elbow": ("lowerarm_l", (0.0, -1.0, 0.0)), "knee": ("calf_l", (0.0, 1.0, 0.0))}
DEGREES = 90.0, 120.0, 140.0, 155.0
FRAMES = 16, 32


@dataclass
class Skin:
    bones: Bones
    points: np.ndarray
    triangles: np.ndarray
    weights: np.ndarray  # [vertices, bones], of sum 1

    def joint(self, bone: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The bone's head, and the directions of its parent and of itself."""
        rest, parent = self.bones.rest.astype(float), self.bones.parents[bone]
        return rest[bone, :3, 3], unit(rest[bone, :3, 3] - rest[parent, :3, 3]), rest[bone, :3, 1]

    def bent(self, bone: int, degrees: float, towards: np.ndarray) -> np.ndarray:
        """Motions float32 [bones, 4, 4] where the bone and its parent make this angle."""
        _head, before, along = self.joint(bone)
        axis, angle = np.cross(before, along), np.arccos(np.clip(before @ along, -1, 1))
        if np.linalg.norm(axis) < 0.15:
            axis, angle = np.cross(along, towards), 0.0
        turn = sinew.affine.from_axis_angle(unit(axis), np.radians(degrees) - angle)[:3, :3]
        pose = battery.posed(self.bones, battery.Pose("bent", {bone: turn}))
        return (pose @ np.linalg.inv(self.bones.rest)).astype(np.float32)

    def share_no_joint(self, pairs: np.ndarray) -> int:
        """The pairs of triangles whose bones are neither the same nor next to each other nor siblings."""
        parents = np.array(self.bones.parents)
        heaviest = self.weights.argmax(axis=1)[self.triangles]
        first, second = heaviest[pairs[:, 0], :, None], heaviest[pairs[:, 1], None, :]
        joined = (first == second) | (parents[first] == second) | (parents[second] == first)
        joined |= (parents[first] == parents[second]) & (parents[first] >= 0)
        return int((~joined.any(axis=(1, 2))).sum())

    def deformed(self, method: str, motions: np.ndarray) -> np.ndarray:
        deformer = sinew.Deformer(self.points, *influences(self.weights), method)
        return deformer.deform(motions).astype(float)

    def kept_apart(self, posed: np.ndarray, bone: int, motions: np.ndarray, every: bool) -> np.ndarray:
        """every: also vertices of one of the two bones alone"""
        parent, (joint, before, after) = self.bones.parents[bone], self.joint(bone)
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


def tube() -> Skin:
    """That of the tests, with bones along z."""
    made = Tube()
    rest = np.tile(sinew.affine.from_axis_angle([1.0, 0.0, 0.0], np.pi / 2), (2, 1, 1))
    rest[1, 2, 3] = 2.0
    bones = replace(
        Bones.none(),
        names=("first", "second"),
        deform=np.ones(2, bool),
        rest=rest,
        lengths=np.full(2, 2.0),
        segments=np.ones(2, int),
        parents=np.array([-1, 0]),
    )
    return Skin(bones, made.points.astype(np.float32), made.triangles, made.weights)


def mesh() -> bpy.types.Object:
    skinned = [obj for obj in bpy.data.objects if obj.type == "MESH" and obj.find_armature()]
    return max(skinned, key=lambda each: len(each.data.vertices))


def motions_at(bones: Bones, frame: int) -> np.ndarray:
    """float32 [bones, 4, 4]"""
    bpy.context.scene.frame_set(frame)
    posed = mesh().find_armature().evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones
    pose = np.array([posed[name].matrix for name in bones.names])
    return (pose @ np.linalg.inv(bones.rest)).astype(np.float32)


def read(path: str) -> Skin:
    bpy.ops.wm.open_mainfile(filepath=path)
    obj = mesh()
    armature = obj.find_armature()
    bones = armature_io.read_bones(armature.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    space = np.array(armature.matrix_world.inverted() @ obj.matrix_world)
    of_groups = bones.of_groups([group.name for group in obj.vertex_groups])
    weights = np.zeros((len(obj.data.vertices), len(bones.names)))
    for vertex in obj.data.vertices:
        for entry in vertex.groups:
            if of_groups[entry.group] >= 0:
                weights[vertex.index, of_groups[entry.group]] += entry.weight
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
    points = transformed(mesh_io.read_points(obj.data), space).astype(np.float32)
    return Skin(bones, points, mesh_io.read_triangles(obj.data), weights)


def bend(skin: Skin, joint: str, bone: int, towards: tuple[float, float, float]) -> None:
    at_rest = crossing_triangles(skin.points, skin.triangles)
    for degrees in DEGREES:
        motions = skin.bent(bone, degrees, np.array(towards))
        for method in ("lbs", "dq"):
            posed = skin.deformed(method, motions)
            shapes = [posed, *(skin.kept_apart(posed, bone, motions, every) for every in (False, True))]
            before, both, either = (len(crossing_triangles(s, skin.triangles) - at_rest) for s in shapes)
            print(f"{f'{joint}, {degrees:g}, {method}':20}{before:8}{both:24}{either:12}")


def main() -> None:
    print("pairs of triangles that cross, without those at rest")
    print(f"{'':20}{'before':>8}{'vertices of both bones':>24}{'of either':>12}")
    bend(tube(), "tube", 1, (0.0, 1.0, 0.0))
    human = read(sys.argv[1])
    for joint, (name, towards) in JOINTS.items():
        bend(human, joint, human.bones.names.index(name), towards)
    print("of the action, with dq: those, and how many of them are between parts that share no joint")
    at_rest = crossing_triangles(human.points, human.triangles)
    for frame in FRAMES:
        posed = human.deformed("dq", motions_at(human.bones, frame))
        pairs = np.array(sorted(crossing_triangles(posed, human.triangles) - at_rest)).reshape(-1, 2)
        print(f"{f'frame {frame}':20}{len(pairs):8}{human.share_no_joint(pairs):8}")


if __name__ == "__main__":
    main()
