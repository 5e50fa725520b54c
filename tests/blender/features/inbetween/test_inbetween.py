# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects in-betweens: keys by the library's methods in a copy of the action, and the original as it was."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import scenes
import sinew
from mathutils import Matrix, Quaternion, Vector
from scipy.spatial.transform import Rotation
from sinew_addon.base.errors import SinewError
from sinew_addon.base.steps import result_of
from sinew_addon.features.action_copy import action_copy
from sinew_addon.features.inbetween import inbetween_bake, keyed_poses
from sinew_addon.io import actions

pytestmark = pytest.mark.long_term

METHODS = sinew.interpolate.METHODS
PATHS = ("straight", "spline")
FRAMES = range(-3, 45)
KEYS = (1, 11, 26, 31)

# What remains of the library's float64 in Blender's float32, for rigs of a few units.
CLOSE = 2e-6


def make_rig(modes: tuple[str, ...] = ("QUATERNION", "ZXY", "AXIS_ANGLE"), name: str = "Rig"):
    """A chain of bones along Y, each rotated about X by 0.3 at rest, with all rotation modes in turn."""
    armature = scenes.added(name, bpy.data.armatures.new(name))
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    parent, head, direction = None, Vector(), Vector((0.0, 1.0, 0.0))
    for index in range(len(modes)):
        bone = armature.data.edit_bones.new(f"bone.{index}")
        bone.head, bone.tail = head, head + direction
        bone.parent, bone.use_connect = parent, False
        parent, head = bone, head + direction
        direction = Matrix.Rotation(0.3, 3, "X") @ direction
    bpy.ops.object.mode_set(mode="OBJECT")
    for bone, mode in zip(armature.pose.bones, modes, strict=True):
        bone.rotation_mode = mode
    return armature


def key_random_poses(armature, interpolation="LINEAR", seed=1) -> None:
    """Keys location, rotation and scale of every bone; rotations are at most 2.2 radians from rest."""
    random = np.random.default_rng(seed)
    for frame in KEYS:
        for bone in armature.pose.bones:
            axis = random.normal(size=3)
            turn = Quaternion(axis / np.linalg.norm(axis), random.uniform(0.2, 1.1))
            set_rotation(bone, turn)
            bone.location = random.uniform(-1.0, 1.0, 3)
            bone.scale = random.uniform(0.6, 1.5, 3)
            for name in ("location", rotation_of(bone), "scale"):
                bone.keyframe_insert(name, frame=frame)
    for curve in curves_of(armature):
        for point in curve.keyframe_points:
            point.interpolation = interpolation
        curve.update()


def rotation_of(bone) -> str:
    return {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}.get(
        bone.rotation_mode, "rotation_euler"
    )


def set_rotation(bone, turn: Quaternion) -> None:
    if bone.rotation_mode == "QUATERNION":
        bone.rotation_quaternion = turn
    elif bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
    else:
        bone.rotation_euler = turn.to_euler(bone.rotation_mode)


def curves_of(armature) -> list:
    return [c for curves in actions.curve_lists(*actions.playing(armature)) for c in curves]


def film(armature, frames=FRAMES, name: str = "matrix") -> np.ndarray:
    """float64 [frames, bones, 4, 4] of the evaluated poses."""
    return scenes.at_frames(frames, lambda: scenes.pose_of(armature, name))


def bake(armature, method="sclerp", path="straight", **settings) -> inbetween_bake.Baked:
    baked = result_of(inbetween_bake.steps(armature, method, path, **settings))
    bpy.context.view_layer.update()
    return baked


def restore(armature) -> None:
    action_copy.restore(armature)
    bpy.context.view_layer.update()


def state(armature) -> list:
    """Everything in the action's curves that Sinew could have changed."""
    return [
        (
            curve.data_path,
            curve.array_index,
            curve.mute,
            [
                (*p.co, *p.handle_left, *p.handle_right, p.interpolation, p.type)
                for p in curve.keyframe_points
            ],
        )
        for curve in curves_of(armature)
    ]


def quat_vecs(bases: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """float64 [.., 7] and scales [.., 3] of matrix_basis matrices that Blender made from keyed channels."""
    scale = np.linalg.norm(bases[..., :3, :3], axis=-2)
    rotation = Rotation.from_matrix((bases[..., :3, :3] / scale[..., None, :]).reshape(-1, 3, 3))
    quaternions = rotation.as_quat(scalar_first=True).reshape(*bases.shape[:-2], 4)
    return np.concatenate([quaternions, bases[..., :3, 3]], axis=-1), scale


def basis(rigid: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """[.., 4, 4] from transforms [.., 4, 4] and scales [.., 3]."""
    result = np.array(rigid)
    result[..., :3, :3] *= scale[..., None, :]
    return result


def in_layout(method: str, rigid: np.ndarray) -> np.ndarray:
    layouts = {"m": sinew.quat_vec.to_affine, "q": np.array}
    return layouts.get(method[0], sinew.quat_vec.to_dual_quat)(rigid)


def to_rotation_and_stretch(method: str, transform: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """[4, 4] rigid and [3]: the part of a method's result that a bone can have."""
    if method.startswith("qv_"):
        return sinew.quat_vec.to_affine(transform), np.ones(3)
    if not method.startswith("matrix_"):
        return sinew.dual_quat.to_affine(transform), np.ones(3)
    u, _s, vt = np.linalg.svd(transform[:3, :3])
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = u @ vt, transform[:3, 3]
    stretch = np.linalg.norm(transform[:3, :3], axis=0) if method == "matrix_linear" else np.ones(3)
    return rigid, stretch


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("method", METHODS)
def test_equals_the_library_between_keys_and_blender_at_keys(method, path):
    armature = make_rig()
    key_random_poses(armature)
    keyed_matrices, keyed = film(armature, KEYS), film(armature, KEYS, "matrix_basis")
    bake(armature, method, path)
    # Rotations are written close to the key before, and so with another rounding.
    assert np.abs(film(armature, KEYS) - keyed_matrices).max() < CLOSE
    rigid, scale = quat_vecs(keyed)
    layout = in_layout(method, rigid)
    scale_as_shift = np.concatenate([np.broadcast_to([1.0, 0, 0, 0], (*scale.shape[:-1], 4)), scale], axis=-1)
    moved = 0.0
    for frame in (2, 6, 10, 13, 18, 27, 30):
        bpy.context.scene.frame_set(frame)
        key = int(np.searchsorted(KEYS, frame, side="right")) - 1
        u = (frame - KEYS[key]) / (KEYS[key + 1] - KEYS[key])
        for bone in range(3):
            if path == "straight":
                value = sinew.interpolate.between(layout[key, bone], layout[key + 1, bone], u, method)
                wanted_scale = (1 - u) * scale[key, bone] + u * scale[key + 1, bone]
            else:
                times = np.array(KEYS, dtype=float)
                value = sinew.spline.catmull_rom(layout[:, bone].copy(), times, frame, method)
                wanted_scale = sinew.spline.catmull_rom_vector(
                    scale_as_shift[:, bone].copy(), times, frame
                ).transforms[4:]
            assert value.is_defined
            wanted, stretch = to_rotation_and_stretch(method, value.transforms)
            got = np.array(scenes.evaluated(armature).pose.bones[bone].matrix_basis)
            assert np.abs(got - basis(wanted, wanted_scale * stretch)).max() < CLOSE
            moved = max(moved, np.abs(got - keyed[key, bone]).max())
    assert moved > 0.3, "nothing moves: nothing is tested"


@pytest.mark.parametrize("interpolation", ["BEZIER", "CONSTANT", "SINE", "BACK", "ELASTIC", "BOUNCE", "EXPO"])
def test_timing_is_that_of_the_keys(interpolation):
    """A hinge has only one path, so only the timing could differ: it is Blender's own."""
    armature = make_rig(("XYZ",))
    bone = armature.pose.bones[0]
    for frame, angle in zip(KEYS, (0.0, 1.4, 0.3, 1.0), strict=True):
        bone.rotation_euler.x = angle
        bone.keyframe_insert("rotation_euler", index=0, frame=frame)
    for curve in curves_of(armature):
        for key in curve.keyframe_points:
            key.interpolation = interpolation
    frames = range(-1, 34)
    blender = film(armature, frames)
    bake(armature, "qv_slerp")
    assert np.abs(film(armature, frames) - blender).max() < CLOSE


def test_a_spline_holds_still_after_constant_keys():
    armature = make_rig(("QUATERNION",))
    key_random_poses(armature)
    for curve in curves_of(armature):
        curve.keyframe_points[1].interpolation = "CONSTANT"
    bake(armature, "sclerp", "spline")
    shown = film(armature, (11, 15, 25, 26, 27))
    assert np.abs(shown[1:3] - shown[0]).max() < CLOSE
    assert np.abs(shown[3] - shown[0]).max() > 0.1
    assert np.abs(shown[4] - shown[3]).max() > 0.01


def test_channels_without_keys_are_left_alone():
    """A bone that only rotates does not swing about the position where it was put by hand; a bone rotated
    about one axis keeps its other angles."""
    armature = make_rig(("QUATERNION", "XYZ", "XYZ"))
    turning, hinge, sliding = armature.pose.bones
    turning.location, hinge.rotation_euler = (1.0, 2.0, 3.0), (0.0, 0.5, 0.0)
    turns = [(frame, Quaternion((1, 0, 0), 0.2 * frame)) for frame in (1, 11)]
    scenes.key(turning, "rotation_quaternion", turns)
    for frame in (1, 11):
        hinge.rotation_euler.x = 0.1 * frame
        hinge.keyframe_insert("rotation_euler", index=0, frame=frame)
        sliding.location.y = frame
        sliding.keyframe_insert("location", index=1, frame=frame)
    bake(armature)
    bpy.context.scene.frame_set(6)
    assert turning.location[:] == (1.0, 2.0, 3.0)
    assert hinge.rotation_euler[1:] == (0.5, 0.0)
    assert sliding.location[0] == sliding.location[2] == 0.0
    assert sliding.location.y == pytest.approx(6.0, abs=1e-5)
    turning.location.x = 5.0
    bpy.context.scene.frame_set(7)
    assert turning.location.x == 5.0


def test_a_bone_with_noise_is_left_to_blender():
    armature = make_rig(("QUATERNION", "QUATERNION"))
    key_random_poses(armature)
    curve = next(c for c in curves_of(armature) if "bone.1" in c.data_path)
    curve.modifiers.new("NOISE")
    blender = film(armature, name="matrix_basis")
    assert bake(armature).left == {"bone.1": "has an F-curve modifier (noise)"}
    shown = film(armature, name="matrix_basis")
    assert np.array_equal(shown[:, 1], blender[:, 1])
    assert np.abs(shown[:, 0] - blender[:, 0]).max() > 0.01


def test_half_a_turn_between_keys_is_told():
    armature = make_rig(("QUATERNION",))
    bone = armature.pose.bones[0]
    for frame, turn in ((1, 0.0), (11, math.pi), (21, math.pi / 2)):
        bone.rotation_quaternion = Quaternion((0, 0, 1), turn)
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    assert bake(armature).far == {"bone.0"}
    assert np.isfinite(film(armature)).all()


def test_some_bones():
    armature = make_rig(("QUATERNION", "XYZ"))
    key_random_poses(armature, interpolation="BEZIER")
    blender = film(armature, name="matrix_basis")
    assert bake(armature, only=["bone.0"]).bones == 1
    shown = film(armature, name="matrix_basis")
    apart = np.abs(shown - blender).max(axis=(2, 3))
    assert apart[:, 1].max() == 0.0
    assert apart[:, 0].max() > 0.01
    assert apart[[FRAMES.index(frame) for frame in KEYS], 0].max() < CLOSE


@pytest.mark.skipif(bpy.app.version < (4, 4), reason="Blender 4.3 and older have no slots")
def test_only_the_slot_that_is_played_is_keyed():
    armature, other = make_rig(), make_rig(name="Other")
    key_random_poses(armature)
    original = armature.animation_data.action_slot
    other.animation_data_create().action = armature.animation_data.action
    other.animation_data.action_slot = armature.animation_data.action.slots.new("OBJECT", "Other")
    key_random_poses(other, seed=2)
    assert other.animation_data.action == armature.animation_data.action
    blender, before = film(other), state(other)
    bake(armature)
    assert state(other) == before
    assert np.array_equal(film(other), blender)
    assert armature.animation_data.action_slot.handle == original.handle


def test_keys_are_kept_with_all_else_of_the_action():
    armature = make_rig()
    key_random_poses(armature, interpolation="BEZIER")
    for number, curve in enumerate(curves_of(armature)):
        curve.extrapolation = ("LINEAR", "CONSTANT")[number % 2]
        if "bone.1" in curve.data_path:
            curve.keyframe_points[1].interpolation = "CONSTANT"
        elif "bone.2" in curve.data_path:
            for point in curve.keyframe_points:
                point.co.x += 0.4
        curve.update()
    armature["custom"] = 1.0
    armature.keyframe_insert('["custom"]', frame=1)
    original, before = armature.animation_data.action, state(armature)
    late = [key + 0.4 for key in KEYS]
    keyed = film(armature, late, "matrix_basis")
    assert bpy.ops.sinew.bake_inbetweens(method="sclerp") == {"FINISHED"}
    assert armature.animation_data.action != original
    assert original.use_fake_user
    # Also where the artist's keys are between frames.
    assert np.abs(film(armature, late, "matrix_basis")[:, 2] - keyed[:, 2]).max() < CLOSE
    assert any(curve.data_path == '["custom"]' for curve in curves_of(armature))
    location = next(c for c in curves_of(armature) if "bone.0" in c.data_path)
    kinds = {p.co.x: p.type for p in location.keyframe_points if 1 <= p.co.x <= 31}
    assert [time for time, kind in kinds.items() if kind == "KEYFRAME"] == list(KEYS)
    assert len(kinds) == 31
    held = next(c for c in curves_of(armature) if "bone.1" in c.data_path)
    assert {p.interpolation for p in held.keyframe_points if 11 <= p.co.x < 26} == {"CONSTANT"}
    armature.animation_data.action = original
    assert state(armature) == before


def test_baked_rotations_do_not_tumble_between_frames():
    """Quaternions of either sign and angles beyond 360 degrees at keys: adjacent keys are written with
    the nearest values."""
    armature = make_rig(("QUATERNION", "XYZ", "AXIS_ANGLE"))
    for number, frame in enumerate(KEYS):
        turn = Quaternion((1, 0.2, 0), 0.6 * (number + 1))
        for bone in armature.pose.bones:
            set_rotation(bone, turn)
            if number % 2:
                bone.rotation_quaternion = -turn
                bone.rotation_euler.x += 4 * math.pi
                bone.rotation_axis_angle[0] -= 2 * math.pi
            bone.keyframe_insert(rotation_of(bone), frame=frame)
    for curve in curves_of(armature):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    bake(armature, "qv_slerp")
    shown = film(armature, np.arange(1, 31, 0.25), "matrix_basis")
    # At most 0.6 radians from key to key, so a quarter of a frame moves little.
    assert np.abs(np.diff(shown, axis=0)).max() < 0.05


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("mode", ["REPEAT", "REPEAT_OFFSET"])
def test_a_baked_cycle_is_a_cycle(mode, path):
    armature = make_rig(("QUATERNION",))
    key_random_poses(armature)
    bone = armature.pose.bones[0]
    for curve in curves_of(armature):
        if "location" not in curve.data_path or mode == "REPEAT":
            curve.keyframe_points[-1].co.y = curve.keyframe_points[0].co.y
            curve.update()
        modifier = curve.modifiers.new("CYCLES")
        modifier.mode_before = modifier.mode_after = mode
    bpy.context.scene.frame_set(1)
    first = np.array(bone.location)
    bpy.context.scene.frame_set(31)
    gain = np.array(bone.location) - first
    groups, _left = keyed_poses.read(armature)
    before, at, after = (
        keyed_poses.pose_at(armature, groups, time, "sclerp", path)[0] for time in (30.99, 31.0, 31.01)
    )
    bake(armature, "sclerp", path)
    inside = np.array([1, 4, 11, 20, 29, 30])
    one_round = film(armature, inside, "matrix_basis")
    for rounds in (-2, -1, 1, 3):
        moved = film(armature, inside + 30 * rounds, "matrix_basis")
        moved[..., :3, 3] -= rounds * gain
        # float32 times and values, some cycles later.
        assert np.abs(moved - one_round).max() < 2e-5
    # A spline has no corner at the seam: the speed before and after it is the same.
    corner = np.abs((after - at) - (at - before)).max()
    assert (corner < 1e-3) == (path == "spline")


def test_bake_says_why_not():
    armature = make_rig()
    with pytest.raises(SinewError, match="key some poses"):
        bake(armature)
    key_random_poses(armature)
    armature.animation_data.action_blend_type = "ADD"
    with pytest.raises(RuntimeError, match="mixed with NLA strips"):
        bpy.ops.sinew.bake_inbetweens()
    assert len(bpy.data.actions) == 1
