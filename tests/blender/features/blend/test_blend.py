# SPDX-License-Identifier: GPL-3.0-or-later
"""Blended actions of an armature: what Blender plays equals what the mathematics computes from what Blender
played."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import walks
from mathutils import Matrix
from program import complaint, run_sinew
from sinew import quat_vec
from sinew_addon.base.steps import result_of
from sinew_addon.features.blend import blend_actions, clips_io, motion
from sinew_addon.features.blend.motion import Settings
from sinew_addon.io import actions, files

pytestmark = pytest.mark.outer_versions

CLOSE = 2e-5
MODES = ("QUATERNION", "XYZ", "ZYX", "AXIS_ANGLE")


def make_legs(modes=("QUATERNION",)):
    """The rig of walks.py in Blender, with alternating rotation modes."""
    rig = walks.rig()
    armature = scenes.added("Legs", bpy.data.armatures.new("Legs"))
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    rest = quat_vec.to_affine(rig.to_armature(np.tile(quat_vec.identity(), (8, 1))))
    for bone, (name_of, parent) in enumerate(zip(rig.names, rig.parents, strict=True)):
        made = armature.data.edit_bones.new(name_of)
        made.head = (0, 0, 0)
        made.tail = (0, rig.lengths[bone], 0)
        made.matrix = Matrix(rest[bone].tolist())
        made.length = rig.lengths[bone]
        if parent >= 0:
            made.parent = armature.data.edit_bones[rig.names[parent]]
    for bone in rig.names:
        armature.data.edit_bones[bone].use_connect = walks.is_connected(bone)
    bpy.ops.object.mode_set(mode="OBJECT")
    for number, bone in enumerate(armature.pose.bones):
        bone.rotation_mode = modes[number % len(modes)]
    return armature


def key_clip(armature, clip):
    """A clip keyed by Blender itself, as an action with its name."""
    armature.animation_data_create().action = None
    if armature.animation_data.action is None:
        for bone in armature.pose.bones:
            bone.matrix_basis = Matrix()
    matrices = quat_vec.to_affine(clip.poses.rigid)
    for frame in range(len(matrices)):
        for row, name in enumerate(clip.rig.names):
            bone = armature.pose.bones[name]
            scale = clip.poses.scale[frame, row]
            bone.matrix_basis = Matrix(matrices[frame, row].tolist()) @ Matrix.Diagonal((*scale, 1.0))
            rotation = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}.get(
                bone.rotation_mode, "rotation_euler"
            )
            for path in ("location", rotation, "scale"):
                bone.keyframe_insert(path, frame=1 + frame)
    action = armature.animation_data.action
    action.name = clip.name
    action.use_fake_user = True
    return action


def make_walks(modes=("QUATERNION",)):
    armature = make_legs(modes)
    bpy.context.scene.frame_start = 1
    pair = walks.walk("WALK"), walks.walk("RUN", 30, 1.1, 0.2, start=0.3)
    return armature, [key_clip(armature, clip) for clip in pair], pair


def film(armature, frames):
    """float64 [frames, bones, 4, 4]: the evaluated pose in armature space, in the order of the rig."""
    order = [armature.pose.bones.find(name) for name in clips_io.rig_of(armature).names]
    return scenes.at_frames(frames, lambda: scenes.pose_of(armature)[order])


def played(armature, action, frames):
    actions.play(armature, action)
    return film(armature, frames)


# --- Reading and writing


@pytest.mark.parametrize("modes", [("QUATERNION",), MODES])
def test_a_clip_is_what_blender_plays(modes):
    armature, (walk, run), pair = make_walks(modes)
    for action, source in ((walk, pair[0]), (run, pair[1])):
        clip = result_of(clips_io.read(armature, action))
        assert clip.length == source.length
        assert not clip.is_cyclic
        shown = played(armature, action, range(1, 2 + round(clip.length)))
        posed = quat_vec.to_affine(clip.rig.to_armature(clip.poses.rigid))
        assert np.abs(posed - shown).max() < CLOSE
        order = [source.rig.names.index(name) for name in clip.rig.names]
        wanted = quat_vec.to_affine(source.poses.rigid)[:, order]
        assert np.abs(quat_vec.to_affine(clip.poses.rigid) - wanted).max() < CLOSE


def test_random_poses_with_scale_come_back_in_every_rotation_mode():
    armature = make_legs(MODES)
    clip = walks.random_clip(np.random.default_rng(4), "random")
    # A connected bone has no location.
    clip.poses.rigid[:, [walks.is_connected(name) for name in clip.rig.names], 4:] = 0.0
    action = key_clip(armature, clip)
    read = result_of(clips_io.read(armature, action))
    again = result_of(clips_io.write(armature, read, "again", 1.0, set()))
    frames = range(1, 14)
    assert np.abs(played(armature, again, frames) - played(armature, action, frames)).max() < CLOSE
    for curve in actions.all_curves(again, actions.slot_for(again, armature)):
        assert {point.interpolation for point in curve.keyframe_points} == {"LINEAR"}
        values = np.array([point.co[1] for point in curve.keyframe_points])
        # Written rotations are close to those of the frame before, so nothing spins between frames.
        assert np.abs(np.diff(values)).max() < 1.5


# --- Blending


@pytest.mark.parametrize("method", motion.METHODS)
def test_blender_plays_the_blend(method):
    armature, chosen, pair = make_walks(MODES)
    settings = Settings(method=method, cycles=2)
    made = result_of(blend_actions.make(armature, chosen, (0.4, 0.6), settings))
    blend = motion.blend(pair, (0.4, 0.6), settings)
    order = [blend.rig.names.index(name) for name in clips_io.rig_of(armature).names]
    shown = played(armature, made.action, range(1, 1 + made.frames))
    wanted = quat_vec.to_affine(blend.rig.to_armature(blend.poses.rigid))[:, order]
    if method != "matrix_linear":
        assert np.abs(shown - wanted).max() < 5 * CLOSE
    else:
        volume = np.linalg.det(shown[..., :3, :3])
        assert volume.min() < 0.999
        assert np.abs(volume[0, 0] - blend.volume[0, 0]) < CLOSE


def test_the_actions_and_all_else_stay_as_they_were():
    armature, chosen, _pair = make_walks()
    keys = [[(c.data_path, [tuple(p.co) for p in c.keyframe_points]) for c in
             actions.all_curves(a, actions.slot_for(a, armature))] for a in chosen]  # fmt: skip
    assert bpy.ops.sinew.blend_actions(actions=rows(chosen)) == {"FINISHED"}
    made = armature.animation_data.action
    assert made.name == "Blend WALK RUN"
    assert made not in chosen
    assert [[(c.data_path, [tuple(p.co) for p in c.keyframe_points]) for c in
             actions.all_curves(a, actions.slot_for(a, armature))] for a in chosen] == keys  # fmt: skip
    assert len(bpy.data.actions) == 3


# --- The operator


def rows(chosen, weights=(1.0, 1.0), first=(1.0, 1.0)):
    """Actions as the dialog has them."""
    return [
        {"name": action.name, "weight": weight, "weight_from": weight_from}
        for action, weight, weight_from in zip(chosen, weights, first, strict=True)
    ]


def test_the_operator_blends_and_undo_takes_it_back():
    armature, chosen, _pair = make_walks()
    actions.play(armature, chosen[0])
    with pytest.raises(RuntimeError, match="choose two actions or more"):
        bpy.ops.sinew.blend_actions(actions=rows(chosen, (1.0, 0.0)))
    gone = {"name": "GONE", "weight": 1.0, "weight_from": 1.0}
    with pytest.raises(RuntimeError, match="no action 'GONE'"):
        bpy.ops.sinew.blend_actions(actions=[*rows(chosen), gone])
    empty = bpy.data.actions.new("EMPTY")
    with pytest.raises(RuntimeError, match="EMPTY moves no bone of Legs: choose another action"):
        bpy.ops.sinew.blend_actions(actions=rows((chosen[0], empty)))
    bpy.data.actions.remove(empty)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.sinew.blend_actions(actions=rows(chosen, (1.0, 0.5)), method="sclerp") == {"FINISHED"}
    assert len(film(armature, range(1, 3))) == 2
    assert armature.animation_data.action.frame_range[1] == 24.0
    bpy.ops.ed.undo_push(message="Blend Actions")
    bpy.ops.ed.undo()
    armature = bpy.data.objects["Legs"]
    assert armature.animation_data.action.name == "WALK"
    assert len(bpy.data.actions) == 2


# --- The command


@pytest.fixture
def walking(tmp_path):
    _armature, _chosen, _pair = make_walks()
    path = tmp_path / "walking.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_the_command_writes_a_copy(walking, tmp_path):
    before, out = walking.read_bytes(), tmp_path / "blended.blend"
    options = ["--actions", "WALK", "RUN", "--weights", 1, 1, "--align", "--cycles", 2, "--out", out]
    result = run_sinew("blend", walking, *options)
    assert "Blend WALK RUN: 51 frames, a cycle, carried by hips" in result.stdout
    assert walking.read_bytes() == before
    files.open_file(out)
    armature = bpy.data.objects["Legs"]
    assert armature.animation_data.action.name == "Blend WALK RUN"
    assert {"WALK", "RUN"} < set(bpy.data.actions.keys())
    shown = film(armature, (1, 51))
    hips = clips_io.rig_of(armature).names.index("hips")
    assert np.abs(shown[1, hips, :3, 3] - shown[0, hips, :3, 3] - (0, -1.9, 0)).max() < CLOSE
    assert "--overwrite" in run_sinew("blend", walking, *options, status=1).stderr
    run_sinew("blend", walking, *options, "--overwrite", "--weights-from", 1, 0, "--name", "To a Run")
    files.open_file(out)
    assert bpy.data.objects["Legs"].animation_data.action.name == "To a Run"


def test_the_command_says_what_is_wrong(walking, tmp_path):
    out = ["--out", tmp_path / "out.blend"]
    both = ["--actions", "WALK", "RUN"]
    cases = [
        ([walking, *both, "--out", walking, "--overwrite"], "would replace the file itself", 2),
        ([walking, "--actions", "WALK", "JUMP", *out], "no action 'JUMP'; Legs can play: RUN, WALK", 1),
        ([walking, "--actions", "WALK", *out], "expected two actions or more", 2),
        ([walking, *both, "--armature", "Arms", *out], "no armature 'Arms'; there are: Legs", 1),
        ([tmp_path / "none.blend", *both, *out], "no such file", 1),
    ]
    for arguments, sentence, status in cases:
        result = run_sinew("blend", *arguments, status=status)
        assert sentence in complaint(result.stderr)
    assert not (tmp_path / "out.blend").exists()
