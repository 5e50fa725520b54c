# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures blending two clips pose by pose, and all at once, compared with scipy, numpy and Blender's
mathutils. Needs bpy.

Processor times: everything runs on one thread, and longer runs share it with other programs.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import bpy
import common
import numpy as np
import sinew
from mathutils import Matrix, Quaternion, Vector
from scipy.spatial.transform import RigidTransform, Rotation, Slerp
from sinew import interpolate, quat_vec
from sinew_addon.base.steps import result_of

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))
import walks

BONES, FRAMES = 60, 120
SHARE = 0.3


def poses(count: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Two arrays [frames, bones, 7], whose rotations are at most 90 degrees apart."""
    rng = np.random.default_rng(0)
    a = quat_vec.from_twist(rng.uniform(-0.8, 0.8, (*count, 6)))
    return a, quat_vec.compose(a, quat_vec.from_twist(rng.uniform(-0.9, 0.9, (*count, 6))))


# --- Other packages


def mathutils_loop(a: list, b: list) -> list:
    """Slerp and lerp for each bone in each frame, as a script would do it."""
    return [
        [(p.slerp(q, SHARE), s.lerp(t, SHARE)) for (p, s), (q, t) in zip(left, right, strict=True)]
        for left, right in zip(a, b, strict=True)
    ]


def scipy_loop(a: list, b: list) -> list:
    """The same with one Slerp object for each bone in each frame."""
    return [
        (Slerp([0.0, 1.0], Rotation.concatenate([p, q]))(SHARE), (1.0 - SHARE) * s + SHARE * t)
        for (p, s), (q, t) in zip(a, b, strict=True)
    ]


def scipy_at_once(a: Rotation, b: Rotation, s: np.ndarray, t: np.ndarray) -> tuple:
    return a * (a.inv() * b) ** SHARE, (1.0 - SHARE) * s + SHARE * t


def numpy_dlb(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    b = np.where((a[..., :4] * b[..., :4]).sum(-1, keepdims=True) < 0.0, -b, b)
    total = (1.0 - SHARE) * a + SHARE * b
    real, dual = total[..., :4], total[..., 4:]
    length = np.linalg.norm(real, axis=-1, keepdims=True)
    real = real / length
    dual = dual / length
    return np.concatenate([real, dual - real * (real * dual).sum(-1, keepdims=True)], axis=-1)


def times(seconds: float) -> dict:
    """{name: spread() of seconds per call} for BONES bones in FRAMES frames."""
    a, b = poses((FRAMES, BONES))
    weights = np.array([1.0 - SHARE, SHARE])
    pair = np.stack([a, b], axis=2)
    layouts = {"m": quat_vec.to_affine(pair), "q": pair}
    dual = quat_vec.to_dual_quat(pair)

    def of_two(method: str):
        given = layouts.get(method[0], dual)
        first, second = (np.ascontiguousarray(given[:, :, each]) for each in (0, 1))
        return lambda: interpolate.between(first, second, SHARE, method)

    def of_many(method: str):
        given = layouts.get(method[0], dual)
        return lambda: interpolate.blend(given, weights, method)

    rotations = [Rotation.from_quat(each[..., :4].reshape(-1, 4), scalar_first=True) for each in (a, b)]
    places = [each[..., 4:].reshape(-1, 3) for each in (a, b)]
    screws = [RigidTransform.from_components(t, r) for t, r in zip(places, rotations, strict=True)]
    of_mathutils = [
        [[(Quaternion(bone[:4]), Vector(bone[4:])) for bone in frame] for frame in each] for each in (a, b)
    ]
    of_scipy = [list(zip(r, t, strict=True)) for r, t in zip(rotations, places, strict=True)]
    # All must agree, since slerp is unique.
    wanted = interpolate.between(a, b, SHARE, "qv_slerp").transforms.reshape(-1, 7)
    theirs = scipy_at_once(*rotations, *places)
    _same(wanted, np.hstack([theirs[0].as_quat(scalar_first=True), theirs[1]]))
    looped = scipy_loop(*of_scipy)
    _same(wanted, np.array([[*r.as_quat(scalar_first=True), *t] for r, t in looped]))
    theirs = mathutils_loop(*of_mathutils)
    _same(wanted, np.array([[*q, *t] for frame in theirs for q, t in frame]), 1e-5)
    _same(of_many("dlb")().transforms.reshape(-1, 8), numpy_dlb(dual[:, :, 0], dual[:, :, 1]).reshape(-1, 8))
    candidates = {f"sinew/{method}": of_two(method) for method in interpolate.METHODS}
    candidates |= {f"sinew/{method}, of many": of_many(method) for method in interpolate.METHODS}
    candidates |= {
        "numpy/dlb, at once": lambda: numpy_dlb(dual[:, :, 0], dual[:, :, 1]),
        "scipy/slerp, at once": lambda: scipy_at_once(*rotations, *places),
        "scipy/screw, at once": lambda: screws[0] * (screws[0].inv() * screws[1]) ** SHARE,
        "mathutils/slerp, a loop": lambda: mathutils_loop(*of_mathutils),
        "scipy/slerp, a loop": lambda: scipy_loop(*of_scipy),
    }
    return common.alternate(candidates, seconds, time.thread_time)


def _same(a: np.ndarray, b: np.ndarray, close: float = 1e-9) -> None:
    """Rows of pairs or dual quaternions, up to the common sign of a transform's quaternions."""
    signs = np.where((a[:, :4] * b[:, :4]).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    b = b * signs if b.shape[1] == 8 else np.hstack([b[:, :4] * signs, b[:, 4:]])
    assert np.abs(a - b).max() < close


# --- A complete blend


def whole(seconds: float) -> dict:
    """Seconds per call for the parts of a blend of two walks with eight bones in Blender."""
    from sinew_addon.features.blend import blend_actions, motion
    from sinew_addon.features.blend.align import align
    from sinew_addon.features.blend.root import grounded

    walk, run = walks.walk(), walks.walk("run", 30, 1.1, 0.2, start=0.3)
    placed = [grounded(clip, 0, walks.UP).clip for clip in (walk, run)]
    bones = np.ones(len(walk.rig.names), dtype=bool)
    armature, chosen = _in_blender((walk, run))

    def make() -> None:
        steps = blend_actions.make(armature, chosen, (1, 1), motion.Settings())
        bpy.data.actions.remove(result_of(steps).action)

    return common.alternate(
        {
            "align": lambda: align(*placed, bones),
            "blend": lambda: motion.blend([walk, run], (1, 1)),
            "read, blend and write": make,
        },
        seconds,
        time.thread_time,
    )


def _in_blender(pair: tuple) -> tuple:
    """An armature with the walks' bones, and their actions."""
    from sinew_addon.features.blend import clips_io

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    armature = bpy.data.objects.new("Legs", bpy.data.armatures.new("Legs"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    rig = pair[0].rig
    rest = quat_vec.to_affine(rig.to_armature(np.tile(quat_vec.identity(), (len(rig.names), 1))))
    for row, name in enumerate(rig.names):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = (0, 0, 0), (0, rig.lengths[row], 0)
        bone.matrix, bone.length = Matrix(rest[row].tolist()), rig.lengths[row]
        if rig.parents[row] >= 0:
            bone.parent = armature.data.edit_bones[rig.names[rig.parents[row]]]
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature, [result_of(clips_io.write(armature, clip, clip.name, 1.0, set())) for clip in pair]


def main() -> None:
    arguments = common.options(__doc__, "motion", "shorter runs").parse_args()
    seconds = 0.1 if arguments.quick else 1.5
    versions = {"numpy": np.__version__, "sinew": sinew.__version__, "scipy": common.version_of("scipy")}
    facts = common.begin("motion blending", bpy=bpy.app.version_string, **versions)
    spreads, parts = times(seconds), whole(seconds)
    count = BONES * FRAMES
    print(f"Two clips of {BONES} bones and {FRAMES} frames: milliseconds, nanoseconds a bone and frame")
    for name, spread in spreads.items():
        ratio = spread["least"] / spreads["sinew/dlb"]["least"]
        least = spread["least"]
        print(f"{name:26}{least * 1e3:10.2f}{least / count * 1e9:10.0f}{ratio:8.1f} x")
    print("\nTwo walks of eight bones, 21 and 31 frames: milliseconds")
    for name, spread in parts.items():
        print(f"{name:26}{spread['least'] * 1e3:10.2f}{spread['median'] * 1e3:10.2f} (median)")
    common.write(arguments.name, machine=facts, bones=BONES, frames=FRAMES, seconds=spreads, parts=parts)


if __name__ == "__main__":
    with common.registered():
        main()
