# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones between their keyed poses: by the library's methods, live, in renders and baked."""

from __future__ import annotations

import math
import subprocess
import sys

import bpy
import numpy as np
import pytest
import scenes
import sinew
import sinew_addon
from mathutils import Matrix, Quaternion, Vector
from scipy.spatial.transform import Rotation
from sinew_addon.core import inbetween as core
from sinew_addon.features.inbetween import inbetween, inbetween_bake, inbetween_handlers
from sinew_addon.io import actions, files
from test_render import prepare, render_animation

METHODS = sinew.interpolate.METHODS
PATHS = ("straight", "spline")
FRAMES = range(-3, 45)
KEYS = (1, 11, 26, 31)

# What remains of the library's float64 in Blender's float32, for rigs of a few units.
CLOSE = 2e-6


def make_rig(modes: tuple[str, ...] = ("QUATERNION", "ZXY", "AXIS_ANGLE"), name: str = "Rig"):
    """A chain of bones along Y, each rotated about X by 0.3 at rest, with all rotation modes in turn."""
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
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


def key_random_poses(armature, frames=KEYS, interpolation="LINEAR", seed=1, most=2.2) -> None:
    """Keys location, rotation and scale of every bone; rotations are at most `most` radians from rest."""
    random = np.random.default_rng(seed)
    for frame in frames:
        for bone in armature.pose.bones:
            axis = random.normal(size=3)
            turn = Quaternion(axis / np.linalg.norm(axis), random.uniform(0.2, 0.5 * most))
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
    return [c for curves in actions.curve_lists(*inbetween.action_of(armature)) for c in curves]


def go_to(frame: float) -> None:
    whole = math.floor(frame)
    bpy.context.scene.frame_set(whole, subframe=frame - whole)


def evaluated(armature):
    return armature.evaluated_get(bpy.context.evaluated_depsgraph_get())


def matrices(armature, name: str = "matrix") -> np.ndarray:
    """float64 [bones, 4, 4] of the evaluated pose."""
    return np.array([getattr(bone, name) for bone in evaluated(armature).pose.bones], dtype=np.float64)


def film(armature, frames=FRAMES, name: str = "matrix") -> np.ndarray:
    """float64 [frames, bones, 4, 4]."""
    result = []
    for frame in frames:
        go_to(frame)
        result.append(matrices(armature, name))
    return np.array(result)


def choose(armature, method: str = "sclerp", path: str = "straight") -> None:
    armature.sinew_inbetween_path = path
    armature.sinew_inbetween = method
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


def test_the_choices_are_the_librarys_methods():
    assert set(core.METHODS) == set(METHODS)
    choices = bpy.types.Object.bl_rna.properties["sinew_inbetween"].enum_items
    assert [choice.identifier for choice in choices] == ["blender", *core.METHODS]
    assert [choice.identifier for choice in choices if "recommended" in choice.name] == ["qv_slerp"]
    assert choices[1].identifier == "qv_slerp"
    assert len({choice.value for choice in choices}) == len(choices)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("method", METHODS)
def test_equals_the_library_between_keys_and_blender_at_keys(method, path):
    armature = make_rig()
    key_random_poses(armature)
    keyed_matrices, keyed = film(armature, KEYS), film(armature, KEYS, "matrix_basis")
    choose(armature, method, path)
    assert np.array_equal(film(armature, KEYS), keyed_matrices)
    rigid, scale = quat_vecs(keyed)
    layout = in_layout(method, rigid)
    scale_as_shift = np.concatenate([np.broadcast_to([1.0, 0, 0, 0], (*scale.shape[:-1], 4)), scale], axis=-1)
    moved = 0.0
    for frame in (1.25, 6, 10, 13, 18.5, 27, 30.75):
        go_to(frame)
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
            got = np.array(evaluated(armature).pose.bones[bone].matrix_basis)
            assert np.abs(got - basis(wanted, wanted_scale * stretch)).max() < CLOSE
            moved = max(moved, np.abs(got - keyed[key, bone]).max())
    assert moved > 0.3, "nothing moves: nothing is tested"


def test_sclerp_is_the_screw():
    """Half a screw in closed form: half the angle about the same line, half the translation along it."""
    armature = make_rig(("QUATERNION",))
    bone = armature.pose.bones[0]
    axis, point, angle, shift = np.array([2.0, -1.0, 2.0]) / 3.0, np.array([0.5, 1.0, -0.25]), 2.5, 1.5

    def screw(part: float) -> np.ndarray:
        turn = Rotation.from_rotvec(part * angle * axis).as_matrix()
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = turn, point - turn @ point + part * shift * axis
        return result

    for frame, part in ((1, 0.0), (11, 1.0)):
        bone.matrix_basis = Matrix(screw(part).tolist())
        bone.keyframe_insert("location", frame=frame)
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    for curve in curves_of(armature):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    choose(armature, "sclerp")
    for frame, part in ((6, 0.5), (3.5, 0.25)):
        go_to(frame)
        assert np.abs(matrices(armature, "matrix_basis")[0] - screw(part)).max() < CLOSE


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
    frames = np.arange(-1.0, 34.0, 0.5)
    blender = film(armature, frames)
    choose(armature, "qv_slerp")
    assert np.abs(film(armature, frames) - blender).max() < CLOSE


def test_a_spline_holds_still_after_constant_keys():
    armature = make_rig(("QUATERNION",))
    key_random_poses(armature)
    for curve in curves_of(armature):
        curve.keyframe_points[1].interpolation = "CONSTANT"
    choose(armature, "sclerp", "spline")
    shown = film(armature, (11, 15, 25.5, 26, 27))
    assert np.abs(shown[1:3] - shown[0]).max() < CLOSE
    assert np.abs(shown[3] - shown[0]).max() > 0.1
    assert np.abs(shown[4] - shown[3]).max() > 0.01


def test_bones_stay_on_their_parents():
    """In-betweens of root-relative transforms would not (Smith 2013, figure 3.3)."""
    armature = make_rig(("QUATERNION",) * 4)
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        bone.use_connect = bone.parent is not None
    bpy.ops.object.mode_set(mode="OBJECT")
    key_random_poses(armature)
    for method in METHODS:
        choose(armature, method)
        for frame in range(1, 31):
            go_to(frame)
            for bone in evaluated(armature).pose.bones[1:]:
                assert (bone.head - bone.parent.tail).length < 1e-5


def test_constraints_and_drivers_come_after():
    armature = make_rig(("QUATERNION", "QUATERNION", "XYZ"))
    key_random_poses(armature)
    last = armature.pose.bones[2]
    target = bpy.data.objects.new("Target", None)
    bpy.context.scene.collection.objects.link(target)
    target.location = (0.4, 1.2, 0.7)
    track = last.constraints.new("DAMPED_TRACK")
    track.target = target
    copy = armature.pose.bones[1].constraints.new("COPY_SCALE")
    copy.target, copy.subtarget = armature, "bone.0"
    driver = armature.pose.bones[0].driver_add("scale", 1).driver
    driver.expression = "0.5"
    choose(armature, "sclerp")
    go_to(6)
    got, posed = matrices(armature), matrices(armature, "matrix_basis")
    tail = Vector(got[2][:3, 1])
    aim = target.location - Vector(got[2][:3, 3])
    assert tail.angle(aim) < 1e-4, "the constraint was not applied after the in-between"
    # The same pose by hand, without Sinew: the same bones.
    armature.sinew_inbetween = "blender"
    armature.animation_data.action = None
    for bone, matrix in zip(armature.pose.bones, posed, strict=True):
        bone.matrix_basis = Matrix(matrix.tolist())
    bpy.context.view_layer.update()
    assert np.abs(matrices(armature) - got).max() < 1e-5
    assert evaluated(armature).pose.bones[0].scale[1] == pytest.approx(0.5)


def test_off_gives_everything_back():
    armature = make_rig()
    key_random_poses(armature, interpolation="BEZIER")
    armature["custom"] = 1.0
    armature.keyframe_insert('["custom"]', frame=1)
    muted = {3, 17}
    for number in muted:
        curves_of(armature)[number].mute = True
    before, shown = state(armature), film(armature)
    for method in ("sclerp", "matrix_linear"):
        choose(armature, method, "spline")
        assert np.abs(film(armature) - shown).max() > 0.1
    assert sum(curve.mute for curve in curves_of(armature)) == len(curves_of(armature)) - 1
    choose(armature, "blender")
    assert state(armature) == before
    assert np.array_equal(film(armature), shown)
    assert not armature.animation_data.action.is_property_set("sinew_holds")


def test_switching_shows_at_once():
    armature = make_rig()
    key_random_poses(armature)
    go_to(6)
    blender = matrices(armature)
    choose(armature, "sclerp")
    assert np.abs(matrices(armature) - blender).max() > 1e-3
    choose(armature, "blender")
    assert np.array_equal(matrices(armature), blender)


def test_everything_else_in_the_action_plays_on():
    armature = make_rig()
    constraint = armature.pose.bones[1].constraints.new("LIMIT_LOCATION")
    armature["custom"] = 0.0
    for frame, value in ((1, 0.0), (11, 1.0)):
        armature["custom"] = constraint.influence = value
        armature.location.x = armature.pose.bones[2].bbone_curveinx = value
        armature.keyframe_insert('["custom"]', frame=frame)
        armature.keyframe_insert("location", frame=frame)
        constraint.keyframe_insert("influence", frame=frame)
        armature.pose.bones[2].keyframe_insert("bbone_curveinx", frame=frame)
    key_random_poses(armature)

    def others() -> list[float]:
        shown, bones = evaluated(armature), evaluated(armature).pose.bones
        return [
            shown["custom"],
            shown.matrix_world[0][3],
            bones[1].constraints[0].influence,
            bones[2].bbone_curveinx,
        ]

    go_to(4)
    blender = others()
    assert all(0.0 < value < 1.0 for value in blender)
    go_to(1)
    choose(armature, "sclerp")
    go_to(4)
    assert others() == blender


def test_channels_without_keys_are_left_alone():
    """A bone that only rotates does not swing about the position where it was put by hand; a bone rotated
    about one axis keeps its other angles."""
    armature = make_rig(("QUATERNION", "XYZ", "XYZ"))
    turning, hinge, sliding = armature.pose.bones
    turning.location, hinge.rotation_euler = (1.0, 2.0, 3.0), (0.0, 0.5, 0.0)
    for frame in (1, 11):
        turning.rotation_quaternion = Quaternion((1, 0, 0), 0.2 * frame)
        turning.keyframe_insert("rotation_quaternion", frame=frame)
        hinge.rotation_euler.x = 0.1 * frame
        hinge.keyframe_insert("rotation_euler", index=0, frame=frame)
        sliding.location.y = frame
        sliding.keyframe_insert("location", index=1, frame=frame)
    choose(armature, "sclerp")
    go_to(6)
    assert turning.location[:] == (1.0, 2.0, 3.0)
    assert hinge.rotation_euler[1:] == (0.5, 0.0)
    assert sliding.location[0] == sliding.location[2] == 0.0
    assert sliding.location.y == pytest.approx(6.0, abs=1e-5)
    turning.location.x = 5.0
    go_to(7)
    assert turning.location.x == 5.0


def test_a_key_set_while_on_is_taken_up_and_hand_made_poses_stay():
    armature = make_rig(("QUATERNION", "QUATERNION"))
    key_random_poses(armature)
    choose(armature, "sclerp")
    go_to(6)
    first, second = armature.pose.bones
    by_hand = Quaternion((0.0, 0.0, 1.0), 1.0)
    first.rotation_quaternion = second.rotation_quaternion = by_hand
    bpy.context.view_layer.update()
    assert first.keyframe_insert("rotation_quaternion")
    bpy.context.view_layer.update()
    assert first.rotation_quaternion == second.rotation_quaternion == by_hand
    # At a key, even one only of the rotation, the location is Blender's.
    assert first.location[0] == curves_of(armature)[0].evaluate(6)
    go_to(8)
    go_to(6)
    assert first.rotation_quaternion == by_hand
    assert second.rotation_quaternion != by_hand, "an unkeyed pose lasts until the frame changes"
    # A key edited in place, as in the Graph Editor, is visible immediately; one edited by a script, in the
    # next frame.
    curve = next(c for c in curves_of(armature) if c.data_path.endswith("location"))
    assert curve.mute
    before = first.location.x
    curve.keyframe_points[1].co.y = 7.0
    bpy.context.view_layer.update()
    assert before < first.location.x == curve.evaluate(6)
    curve.keyframe_points[1].co.y = 17.0
    go_to(6)
    assert before + 3.0 < first.location.x == curve.evaluate(6)


def test_bones_keyed_for_the_first_time_while_on():
    armature = make_rig(("QUATERNION",))
    choose(armature, "sclerp")
    assert inbetween_handlers.player_of(armature) is None
    key_random_poses(armature)
    bpy.context.view_layer.update()
    assert all(curve.mute for curve in curves_of(armature))
    keyed = film(armature, KEYS, "matrix_basis")
    rigid, _scale = quat_vecs(keyed)
    middle = sinew.interpolate.between(*sinew.quat_vec.to_dual_quat(rigid[:2, 0]), 0.5, "sclerp").transforms
    go_to(6)
    got, _scale = quat_vecs(matrices(armature, "matrix_basis"))
    assert np.abs(sinew.dual_quat.to_affine(middle) - sinew.quat_vec.to_affine(got[0])).max() < CLOSE


def test_an_action_shared_with_an_armature_that_is_off():
    armature = make_rig()
    key_random_poses(armature)
    blender = film(armature)
    other = armature.copy()
    bpy.context.scene.collection.objects.link(other)
    assert other.animation_data.action == armature.animation_data.action
    choose(armature, "sclerp")
    assert np.abs(film(armature) - blender).max() > 0.01
    assert np.abs(film(other) - blender).max() < CLOSE
    choose(other, "qv_slerp")
    choose(armature, "blender")
    assert np.abs(film(armature) - blender).max() < CLOSE
    assert np.abs(film(other) - blender).max() > 0.01
    bpy.data.objects.remove(other)
    bpy.context.view_layer.update()
    assert not any(curve.mute for curve in curves_of(armature))
    assert np.array_equal(film(armature), blender)


def test_another_action_is_chosen_while_on():
    armature = make_rig()
    key_random_poses(armature, seed=1)
    first = armature.animation_data.action
    armature.animation_data.action = None
    key_random_poses(armature, seed=2)
    shown = film(armature, KEYS)
    choose(armature, "sclerp")
    second = armature.animation_data.action
    armature.animation_data.action = first
    bpy.context.view_layer.update()
    assert first.sinew_holds
    assert not second.sinew_holds
    assert np.abs(film(armature, KEYS) - shown).max() > 0.1
    armature.animation_data.action = second
    assert np.array_equal(film(armature, KEYS), shown)
    armature.animation_data.action = None
    bpy.context.view_layer.update()
    assert not first.sinew_holds
    assert not second.sinew_holds


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("mode", ["REPEAT", "REPEAT_OFFSET"])
def test_cycles_repeat_the_inbetweens(mode, path):
    armature = make_rig(("QUATERNION",))
    key_random_poses(armature)
    bone = armature.pose.bones[0]
    for curve in curves_of(armature):
        if "location" not in curve.data_path or mode == "REPEAT":
            curve.keyframe_points[-1].co.y = curve.keyframe_points[0].co.y
            curve.update()
        modifier = curve.modifiers.new("CYCLES")
        modifier.mode_before = modifier.mode_after = mode
    go_to(1)
    first = np.array(bone.location)
    go_to(31)
    gain = np.array(bone.location) - first
    choose(armature, "sclerp", path)
    inside = np.array([1, 1.25, 4, 11, 20.5, 29, 30.75])
    one_round = film(armature, inside, "matrix_basis")
    for rounds in (-2, -1, 1, 3):
        moved = film(armature, inside + 30 * rounds, "matrix_basis")
        moved[..., :3, 3] -= rounds * gain
        # float32 times and values, some cycles later.
        assert np.abs(moved - one_round).max() < 2e-5
    # A spline has no corner at the seam: the speed before and after it is the same.
    before, at, after = film(armature, (31 - 0.01, 31, 31 + 0.01), "matrix_basis")
    corner = np.abs((after - at) - (at - before)).max()
    assert (corner < 1e-3) == (path == "spline")


def test_before_and_after_the_keys_blenders_curves_go_on():
    armature = make_rig(("XYZ",))
    key_random_poses(armature, most=1.0)
    for number, curve in enumerate(curves_of(armature)):
        curve.extrapolation = ("LINEAR", "CONSTANT")[number % 2]
    outside = (-20, -3.5, 0, 32, 40.25)
    blender = film(armature, outside)
    assert np.abs(blender[0] - blender[1]).max() > 0.1
    choose(armature, "sclerp", "spline")
    assert np.array_equal(film(armature, outside), blender)


def test_nla_strips_are_left_to_blender():
    armature = make_rig()
    key_random_poses(armature)
    action = armature.animation_data.action
    track = armature.animation_data.nla_tracks.new()
    strip = track.strips.new("Walk", 1, action)
    assert strip.action == action
    blender = film(armature)
    choose(armature, "sclerp")
    assert "Walk" in inbetween_handlers.problem_of(armature)
    assert inbetween_handlers.player_of(armature) is None
    assert np.array_equal(film(armature), blender)
    track.mute = True
    bpy.context.view_layer.update()
    assert inbetween_handlers.problem_of(armature) is None
    assert np.abs(film(armature) - blender).max() > 0.01
    track.mute = False
    bpy.context.view_layer.update()
    assert np.array_equal(film(armature), blender)


def test_a_bone_with_noise_is_left_to_blender():
    armature = make_rig(("QUATERNION", "QUATERNION"))
    key_random_poses(armature)
    curve = next(c for c in curves_of(armature) if "bone.1" in c.data_path)
    curve.modifiers.new("NOISE")
    blender = film(armature, name="matrix_basis")
    choose(armature, "sclerp")
    assert inbetween_handlers.player_of(armature).left == {"bone.1": "has an F-curve modifier (noise)"}
    shown = film(armature, name="matrix_basis")
    assert np.array_equal(shown[:, 1], blender[:, 1])
    assert np.abs(shown[:, 0] - blender[:, 0]).max() > 0.01
    curve.modifiers.remove(curve.modifiers[0])
    bpy.context.view_layer.update()
    assert np.abs(film(armature, name="matrix_basis")[:, 1] - blender[:, 1]).max() > 0.01


def test_rotation_mode_changed_while_on():
    armature = make_rig(("QUATERNION",))
    key_random_poses(armature)
    choose(armature, "sclerp")
    bone = armature.pose.bones[0]
    bone.rotation_mode = "XYZ"
    bpy.context.view_layer.update()
    without_keys = bone.rotation_euler[:]
    go_to(6)
    assert bone.rotation_euler[:] == without_keys
    muted = {curve.data_path.rsplit(".")[-1] for curve in curves_of(armature) if curve.mute}
    assert muted == {"location", "scale"}
    choose(armature, "blender")
    assert not any(curve.mute for curve in curves_of(armature))


def test_half_a_turn_between_keys_is_told():
    armature = make_rig(("QUATERNION",))
    bone = armature.pose.bones[0]
    for frame, turn in ((1, 0.0), (11, math.pi), (21, math.pi / 2)):
        bone.rotation_quaternion = Quaternion((0, 0, 1), turn)
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    choose(armature, "sclerp")
    go_to(6)
    assert inbetween_handlers.player_of(armature).pose.far == ["bone.0"]
    assert np.isfinite(matrices(armature)).all()
    go_to(16)
    assert inbetween_handlers.player_of(armature).pose.far == []


def test_a_spin_told_by_angles_is_told_too():
    armature = make_rig(("XYZ",))
    bone = armature.pose.bones[0]
    for frame, turn in ((1, 0.0), (11, 4 * math.pi), (21, 4 * math.pi + 1.0)):
        bone.rotation_euler.x = turn
        bone.keyframe_insert("rotation_euler", frame=frame)
    choose(armature, "sclerp")
    go_to(6)
    assert inbetween_handlers.player_of(armature).pose.far == ["bone.0"]
    assert abs(bone.rotation_euler.x) < 1e-4
    go_to(16)
    assert inbetween_handlers.player_of(armature).pose.far == []


def test_undo_and_redo():
    armature = make_rig()
    key_random_poses(armature)
    blender = film(armature)
    go_to(6)
    bpy.ops.ed.undo_push(message="made")
    choose(armature, "sclerp")
    played = film(armature)
    go_to(6)
    bpy.ops.ed.undo_push(message="on")
    bpy.ops.ed.undo()
    armature = bpy.data.objects["Rig"]
    assert armature.sinew_inbetween == "blender"
    assert not any(curve.mute for curve in curves_of(armature))
    assert np.array_equal(film(armature), blender)
    bpy.ops.ed.redo()
    armature = bpy.data.objects["Rig"]
    assert armature.sinew_inbetween == "sclerp"
    assert np.array_equal(film(armature), played)


def test_a_duplicate_plays_too():
    armature = make_rig()
    key_random_poses(armature)
    choose(armature, "sclerp")
    played = film(armature)
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.duplicate()
    other = bpy.context.object
    assert other != armature
    assert other.animation_data.action != armature.animation_data.action
    choose(armature, "blender")
    assert np.array_equal(film(other), played)
    choose(other, "blender")
    assert not any(curve.mute for curve in curves_of(other))


def test_nothing_is_written_where_nothing_changes():
    armature = make_rig()
    key_random_poses(armature)
    choose(armature, "sclerp")
    go_to(6)
    posed = []

    def count(_scene, depsgraph):
        posed.append([update.id.name for update in depsgraph.updates])

    bpy.app.handlers.depsgraph_update_post.append(count)
    try:
        inbetween_handlers.refresh(bpy.context.scene)
        bpy.context.view_layer.update()
        bpy.context.scene.render.resolution_x += 1
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(count)
    assert not any("Rig" in name for names in posed for name in names)


def test_sinew_taken_out_and_in_again():
    armature = make_rig()
    key_random_poses(armature)
    blender, before = film(armature), state(armature)
    choose(armature, "sclerp")
    played = film(armature)
    sinew_addon.unregister()
    try:
        bpy.context.view_layer.update()
        assert state(armature) == before
        assert np.array_equal(film(armature), blender)
    finally:
        sinew_addon.register()
    assert armature.sinew_inbetween == "sclerp"
    assert np.array_equal(film(armature), played)


def test_what_fails_is_left_to_blender_and_said(caplog):
    armature, other = make_rig(), make_rig(name="Other")
    for rig in (armature, other):
        key_random_poses(rig)
    curves_of(armature)[0].keyframe_points[1].co.y = math.nan
    blender = film(other)
    for rig in (armature, other):
        choose(rig, "sclerp")
    go_to(6)
    assert "finite" in inbetween_handlers.problem_of(armature)
    assert not any(curve.mute for curve in curves_of(armature))
    assert sum("finite" in record.message for record in caplog.records) == 1
    assert np.abs(film(other) - blender).max() > 0.01
    curves_of(armature)[0].keyframe_points[1].co.y = 1.0
    choose(armature, "sclerp")
    go_to(6)
    assert inbetween_handlers.problem_of(armature) is None
    assert all(curve.mute for curve in curves_of(armature))


WITHOUT_SINEW = """
import sys, bpy, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Object, "sinew_inbetween")
armature = bpy.data.objects["Rig"]
frames = np.load(sys.argv[2])["frames"]

def read():
    shown = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([bone.matrix for bone in shown.pose.bones])

opened = read()
film = []
for frame in frames:
    whole = int(np.floor(frame))
    bpy.context.scene.frame_set(whole, subframe=float(frame - whole))
    film.append(read())
np.savez(sys.argv[3], opened=opened, film=film, action=armature.animation_data.action.name)
"""


def play_without_sinew(path, folder, frames) -> dict[str, np.ndarray]:
    """The file in a Blender without Sinew: when it is opened, and its frames."""
    np.savez(folder / "frames.npz", frames=np.array(frames, dtype=float))
    result = folder / "read.npz"
    arguments = [str(path), str(folder / "frames.npz"), str(result)]
    subprocess.run([sys.executable, "-c", WITHOUT_SINEW, *arguments], check=True, timeout=120)
    with np.load(result) as read:
        return {name: read[name] for name in read.files}


def test_a_saved_file_plays_its_own_curves_without_sinew_and_ours_with_it(tmp_path):
    armature = make_rig()
    key_random_poses(armature, interpolation="BEZIER")
    blender = film(armature)
    choose(armature, "sclerp", "spline")
    played = film(armature)
    go_to(6)
    shown = matrices(armature)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert np.array_equal(matrices(armature), shown)
    assert all(curve.mute for curve in curves_of(armature))
    without = play_without_sinew(path, tmp_path, FRAMES)
    assert np.abs(without["film"] - blender).max() == 0.0
    assert np.abs(without["opened"] - blender[FRAMES.index(6)]).max() == 0.0
    bpy.ops.wm.open_mainfile(filepath=str(path))
    armature = bpy.data.objects["Rig"]
    assert np.array_equal(matrices(armature), shown)
    assert np.array_equal(film(armature), played)


def test_a_library_override_keeps_the_choice(tmp_path):
    armature = make_rig()
    key_random_poses(armature)
    blender = film(armature)
    choose(armature, "sclerp")
    played = film(armature)
    choose(armature, "blender")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_all, chosen):
        chosen.objects = ["Rig"]
    bpy.context.scene.collection.objects.link(chosen.objects[0])
    armature = chosen.objects[0].override_create(remap_local_usages=True)
    armature.override_library.is_system_override = False
    assert np.array_equal(film(armature), blender)
    choose(armature, "sclerp")
    assert np.array_equal(film(armature), played)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    armature = next(obj for obj in bpy.data.objects if obj.override_library)
    assert armature.sinew_inbetween == "sclerp"
    assert np.array_equal(film(armature), played)


@pytest.mark.parametrize("skinned", [False, True], ids=["modifier", "Sinew"])
def test_meshes_follow_in_the_same_frame(skinned):
    """Live equals baked, which Blender plays from plain keys."""
    obj, armature = scenes.make_arm()
    if skinned:
        scenes.add_sinew(obj, "dq")
    frames = list(range(1, 12))
    blender = scenes.shapes(obj, frames)
    choose(armature, "matrix_log")
    live = scenes.shapes(obj, frames)
    assert scenes.worst(live, blender) > 0.01
    inbetween_bake.bake(armature)
    assert scenes.worst(scenes.shapes(obj, frames), live) < 1e-5


@pytest.mark.skipif(bpy.app.version < (4, 4), reason="Blender 4.3 and older have no slots")
def test_only_the_slot_that_is_played_is_held():
    armature, other = make_rig(), make_rig(name="Other")
    key_random_poses(armature)
    other.animation_data_create().action = armature.animation_data.action
    other.animation_data.action_slot = armature.animation_data.action.slots.new("OBJECT", "Other")
    key_random_poses(other, seed=2)
    assert other.animation_data.action == armature.animation_data.action
    blender, before = film(other), state(other)
    choose(armature, "sclerp")
    assert state(other) == before
    assert np.array_equal(film(other), blender)
    choose(other, "dlb")
    assert np.abs(film(other) - blender).max() > 0.01
    choose(other, "blender")
    assert state(other) == before
    assert all(curve.mute for curve in curves_of(armature))


def test_exported_files_have_the_inbetweens(tmp_path):
    obj, armature = scenes.make_arm()
    scenes.key_pose(armature, 190.0)
    blender = scenes.shapes(obj, [4])[0]
    choose(armature, "sclerp")
    live = scenes.shapes(obj, [4])[0]
    assert scenes.worst(live, blender) > 0.05
    bpy.ops.wm.alembic_export(
        filepath=str(tmp_path / "arm.abc"), start=1, end=11, as_background_job=False, flatten=True
    )
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.alembic_import(filepath=str(tmp_path / "arm.abc"), as_background_job=False)
    exported = next(obj for obj in bpy.data.objects if obj.type == "MESH")
    assert scenes.worst(scenes.shapes(exported, [4])[0], live) < 1e-5


def test_motion_blur_sees_the_inbetweens(tmp_path):
    """A hinge, for which Sinew's in-betweens equal Blender's: with motion blur, the pictures are the
    same."""
    _obj, armature = scenes.make_arm()
    armature.animation_data_clear()
    bone = armature.pose.bones[1]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (11, 2.5)):
        bone.rotation_euler = (0.0, 0.0, angle)
        bone.keyframe_insert("rotation_euler", frame=frame)
    scene = bpy.context.scene
    prepare(scene, motion_blur=True)
    pictures = {}
    times = []

    def note(scene, depsgraph):
        shown = armature.evaluated_get(depsgraph).pose.bones[1]
        times.append((scene.frame_current_final, shown.rotation_euler.z))

    for method in ("blender", "qv_slerp"):
        (tmp_path / method).mkdir()
        choose(armature, method)
        bpy.app.handlers.frame_change_post.append(note)
        try:
            pictures[method] = render_animation(scene, tmp_path / method, (5, 6))
        finally:
            bpy.app.handlers.frame_change_post.remove(note)
    sharp = tmp_path / "sharp"
    sharp.mkdir()
    scene.render.use_motion_blur = False
    unblurred = render_animation(scene, sharp, (5, 6))
    assert np.abs(pictures["blender"] - unblurred).mean() > 0.002
    assert np.abs(pictures["qv_slerp"] - pictures["blender"]).mean() < 2e-4
    curve = curves_of(armature)[2]
    assert {time % 1.0 for time, _angle in times} > {0.0}, "no sub-frame was seen"
    for time, angle in times:
        assert angle == pytest.approx(curve.evaluate(time), abs=1e-5)


@pytest.mark.parametrize("path", PATHS)
def test_baked_keys_play_what_was_live(tmp_path, path):
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
    choose(armature, "sclerp", path)
    live = film(armature)
    late = [key + 0.4 for key in KEYS]
    between = film(armature, late, "matrix_basis")
    armature.select_set(True)
    bpy.context.view_layer.objects.active = armature
    assert bpy.ops.sinew.bake_inbetweens() == {"FINISHED"}
    assert armature.sinew_inbetween == "blender"
    assert armature.animation_data.action != original
    assert original.use_fake_user
    assert np.abs(film(armature) - live).max() < 1e-5
    # Also where the artist's keys are between frames.
    assert np.abs(film(armature, late, "matrix_basis")[:, 2] - between[:, 2]).max() < 1e-5
    assert any(curve.data_path == '["custom"]' for curve in curves_of(armature))
    location = next(c for c in curves_of(armature) if "bone.0" in c.data_path)
    kinds = {p.co.x: p.type for p in location.keyframe_points if 1 <= p.co.x <= 31}
    assert [time for time, kind in kinds.items() if kind == "KEYFRAME"] == list(KEYS)
    assert len(kinds) == 31
    held = next(c for c in curves_of(armature) if "bone.1" in c.data_path)
    assert {p.interpolation for p in held.keyframe_points if 11 <= p.co.x < 26} == {"CONSTANT"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    without = play_without_sinew(tmp_path / "baked.blend", tmp_path, FRAMES)
    assert np.abs(without["film"] - live).max() < 1e-5
    armature.animation_data.action = original
    assert state(armature) == before


def test_bake_every_few_frames_keeps_the_keyed_poses():
    armature = make_rig()
    key_random_poses(armature)
    choose(armature, "sclerp")
    frames = sorted({*range(1, 32, 4), *KEYS})
    live = film(armature, frames)
    baked = inbetween_bake.bake(armature, step=4)
    assert [p.co.x for p in curves_of(armature)[0].keyframe_points] == frames
    assert (baked.bones, baked.far) == (3, set())
    assert np.abs(film(armature, frames) - live).max() < 1e-5


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
    choose(armature, "qv_slerp")
    frames = np.arange(1, 31, 0.25)
    live = film(armature, frames, "matrix_basis")
    inbetween_bake.bake(armature)
    assert np.abs(film(armature, frames, "matrix_basis") - live).max() < 1e-3


def test_a_baked_cycle_is_a_cycle():
    armature = make_rig(("QUATERNION",))
    key_random_poses(armature)
    for curve in curves_of(armature):
        curve.modifiers.new("CYCLES")
    choose(armature, "sclerp", "spline")
    frames = range(-28, 62, 3)
    live = film(armature, frames)
    inbetween_bake.bake(armature)
    assert np.abs(film(armature, frames) - live).max() < 2e-5


def test_bake_says_why_not():
    armature = make_rig()
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    assert not bpy.ops.sinew.bake_inbetweens.poll()
    armature.sinew_inbetween = "sclerp"
    with pytest.raises(RuntimeError, match="key some poses"):
        bpy.ops.sinew.bake_inbetweens()


@pytest.mark.slow
@pytest.mark.parametrize("path", PATHS)
def test_a_real_character(real_rig, path, tmp_path):
    files.open_file(real_rig("human.blend"))
    armature = bpy.data.objects["Rig"]
    frames = range(1, 49)
    blender, before = film(armature, frames), state(armature)
    for method in METHODS:
        choose(armature, method, path)
        played = film(armature, frames)
        for key in (1, 16, 32, 48):
            assert np.array_equal(played[key - 1], blender[key - 1])
        assert np.isfinite(played).all()
        assert np.abs(played - blender).max() > 0.1
    choose(armature, "blender")
    assert np.array_equal(film(armature, frames), blender)
    assert state(armature) == before
    choose(armature, "sclerp", path)
    live = film(armature, frames)
    inbetween_bake.bake(armature)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    assert np.abs(play_without_sinew(tmp_path / "baked.blend", tmp_path, frames)["film"] - live).max() < 1e-5


def test_a_spline_through_keys_turned_far_is_told(real_rig):
    files.open_file(real_rig("human.blend"))
    armature = bpy.data.objects["Rig"]
    choose(armature, "sclerp", "spline")
    go_to(24.9)
    assert "hand_l" in inbetween_handlers.player_of(armature).pose.far
    choose(armature, "dlb", "spline")
    assert inbetween_handlers.player_of(armature).pose.far == []
