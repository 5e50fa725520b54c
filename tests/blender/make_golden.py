# SPDX-License-Identifier: GPL-3.0-or-later
"""Small rigs and what Blender's Armature modifier makes of them, for engines that want to match it.

    python tests/blender/make_golden.py [FOLDER]

FOLDER, by default tests/golden, holds the README that says what is in a case.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import scenes
from mathutils import Euler, Quaternion

FOLDER = Path(__file__).resolve().parents[1] / "golden"


def turned(obj: bpy.types.Object, armature: bpy.types.Object, degrees: float = 80.0) -> None:
    """Every bone rotated about an axis of its own, both objects moved."""
    scenes.forget_keys(armature)
    for index, bone in enumerate(armature.pose.bones):
        axis = ((1.0, 0.2, 0.1), (0.3, 1.0, -0.2), (-0.4, 0.5, 1.0))[index % 3]
        bone.rotation_quaternion = Quaternion(axis, math.radians(degrees))
        bone.location = (0.0, 0.0, 0.0)
    obj.location, obj.rotation_euler, obj.scale = (0.5, -0.2, 0.1), Euler((0.3, 0.1, -0.6)), (1.2, 0.9, 1.1)
    armature.location, armature.rotation_euler = (-0.1, 0.3, 0.2), Euler((-0.2, 0.4, 0.1))


def rotated(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones rotated by 80 degrees, both objects moved"""
    turned(obj, armature)


def weights(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Weights of any sum, zeros, sums below the threshold, vertices without weights"""
    turned(obj, armature)
    rng = np.random.default_rng(1)
    for vertex in range(len(obj.data.vertices)):
        for group in obj.vertex_groups:
            fate = rng.random()
            if fate < 0.2:
                group.remove([vertex])
            elif fate < 0.3:
                group.add([vertex], 0.0, "REPLACE")
            elif fate < 0.5:
                group.add([vertex], float(10.0 ** rng.uniform(-7, -4.5)), "REPLACE")
            else:
                group.add([vertex], float(rng.uniform(0.05, 1.0)), "REPLACE")


def scaled(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones scaled along their axes, children inheriting it with shear"""
    turned(obj, armature)
    armature.pose.bones[0].scale, armature.pose.bones[1].scale = (1.3, 0.8, 1.1), (0.7, 1.4, 1.0)


def mirrored(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """A bone mirrored by a negative scale"""
    turned(obj, armature)
    armature.pose.bones[1].scale = (-1.0, 1.0, 1.2)


def antipodal(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bones more than 180 degrees apart: every other vertex has its groups in the opposite order"""
    turned(obj, armature, degrees=150.0)
    for vertex in range(0, len(obj.data.vertices), 2):
        entries = [(e.group, e.weight) for e in obj.data.vertices[vertex].groups]
        for group, _weight in entries:
            obj.vertex_groups[group].remove([vertex])
        for group, weight in reversed(entries):
            obj.vertex_groups[group].add([vertex], weight, "ADD")


def bendy(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Bendy bones of four segments with straight mapping, curved and rolled"""
    turned(obj, armature)
    for bone in armature.data.bones:
        bone.bbone_segments = 4
    for bone in armature.pose.bones:
        bone.bbone_curveinx, bone.bbone_curveoutz, bone.bbone_rollout = 0.2, -0.15, 0.6


CASES: tuple[Callable[[bpy.types.Object, bpy.types.Object], None], ...] = (
    rotated,
    weights,
    scaled,
    mirrored,
    antipodal,
    bendy,
)


def make(set_up: Callable[[bpy.types.Object, bpy.types.Object], None]) -> tuple[dict, dict[str, np.ndarray]]:
    """One case: what its JSON says, and the arrays of its npz."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj, armature = scenes.make_arm(bones=3, sides=6, rings=10)
    set_up(obj, armature)
    bpy.context.view_layer.update()
    linear, preserve_volume = (scenes.modifier_shapes(obj, [1], flag)[0] for flag in (False, True))
    arrays = {**influences(obj, armature), **bones(armature)}
    arrays["points"] = scenes.rest_points(obj)
    arrays["armature_from_mesh"] = np.array(
        armature.matrix_world.inverted() @ obj.matrix_world, dtype=np.float32
    )
    arrays["linear"], arrays["preserve_volume"] = linear, preserve_volume
    about = {
        "about": set_up.__doc__,
        "blender": bpy.app.version_string,
        "bones": [bone.name for bone in armature.data.bones],
        "arrays": {name: f"{a.dtype} {list(a.shape)}" for name, a in sorted(arrays.items())},
    }
    return about, arrays


def influences(obj: bpy.types.Object, armature: bpy.types.Object) -> dict[str, np.ndarray]:
    names = [bone.name for bone in armature.data.bones]
    entries = [
        [(names.index(obj.vertex_groups[e.group].name), e.weight) for e in vertex.groups]
        for vertex in obj.data.vertices
    ]
    flat = [entry for of_vertex in entries for entry in of_vertex]
    return {
        "offsets": np.cumsum([0, *map(len, entries)]).astype(np.int32),
        "bones": np.array([bone for bone, _weight in flat], dtype=np.int32),
        "weights": np.array([weight for _bone, weight in flat], dtype=np.float32),
    }


def bones(armature: bpy.types.Object) -> dict[str, np.ndarray]:
    """Bones first, then the joints of bendy ones."""
    posed = armature.evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones
    rest_matrices = [np.array(bone.matrix_local) for bone in armature.data.bones]
    pose_matrices = [np.array(bone.matrix) for bone in posed]
    first = []
    for index, bone in enumerate(armature.data.bones):
        first.append(len(rest_matrices))
        for k in range(bone.bbone_segments + 1 if bone.bbone_segments > 1 else 0):
            joint = posed[index].bbone_segment_matrix
            rest_matrices.append(rest_matrices[index] @ np.array(joint(k, rest=True)))
            pose_matrices.append(pose_matrices[index] @ np.array(joint(k, rest=False)))
    return {
        "rest": np.array(rest_matrices, dtype=np.float32),
        "posed": np.array(pose_matrices, dtype=np.float32),
        "lengths": np.array([bone.length for bone in armature.data.bones], dtype=np.float32),
        "segments": np.array([bone.bbone_segments for bone in armature.data.bones], dtype=np.int32),
        "first_joint": np.array(first, dtype=np.int32),
    }


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for set_up in CASES:
        about, arrays = make(set_up)
        (folder / f"{set_up.__name__}.json").write_text(json.dumps(about, indent=2) + "\n")
        np.savez_compressed(folder / f"{set_up.__name__}.npz", **arrays)
        print(f"{folder / set_up.__name__}.npz")


if __name__ == "__main__":
    main()
