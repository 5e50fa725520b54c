# SPDX-License-Identifier: GPL-3.0-or-later
"""A range of motion: bones are where the poses say, whatever else moves them, and all comes back."""

from __future__ import annotations

import math

import bpy
import five_meshes
import numpy as np
import pytest
import scenes
import whole_file
from figures import NAMES, figure, named
from program import run_script
from sinew_addon.deform import session
from sinew_addon.features.measure import battery, motion_range
from sinew_addon.features.motion_range import clip
from sinew_addon.io import armature_io

pytestmark = pytest.mark.outer_versions

MODES = ("QUATERNION", "XYZ", "AXIS_ANGLE", "ZYX")


def make_figure(naming: str, seed: int) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A figure whose bones roll and rotate in any way, with a vertex for each bone."""
    random = np.random.default_rng(seed)
    armature = scenes.added("Rig", bpy.data.armatures.new("Rig"))
    scenes.enter(armature, "EDIT")
    bones, _number = figure(naming)
    for name, parent, rest, length in zip(bones.names, bones.parents, bones.rest, bones.lengths, strict=True):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = rest[:3, 3], rest[:3, 3] + length * rest[:3, 1]
        bone.roll = random.uniform(-math.pi, math.pi)
        if parent >= 0:
            bone.parent = armature.data.edit_bones[bones.names[parent]]
    scenes.enter(armature, "OBJECT")
    for number, bone in enumerate(armature.pose.bones):
        bone.rotation_mode = MODES[number % len(MODES)]
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata([tuple(bone.center) for bone in armature.data.bones], [], [])
    obj = scenes.added("Body", mesh)
    for number, name in enumerate(bones.names):
        obj.vertex_groups.new(name=name).add([number], 1.0, "REPLACE")
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    scenes.add_sinew(obj, "lbs")
    return obj, armature


def obstruct(armature: bpy.types.Object, naming: str) -> None:
    """What moves bones besides keys: a strip, a driver, a constraint, and a bone that follows no rotation."""
    fore, hand = (named(naming, name, "L") for name in ("forearm", "hand"))
    scenes.key(armature.pose.bones[fore], "location", ((1, (0.0, 0.0, 0.0)), (5, (0.0, 0.2, 0.0))))
    strip = armature.animation_data.nla_tracks.new().strips.new("Strip", 1, armature.animation_data.action)
    strip.influence = 0.5
    bone = armature.pose.bones[named(naming, "thigh", "L")]
    bone.driver_add("location", 1).driver.expression = "0.3"
    constraint = armature.pose.bones[hand].constraints.new("LIMIT_ROTATION")
    constraint.owner_space = "LOCAL"
    constraint.use_limit_x = constraint.use_limit_y = constraint.use_limit_z = True
    armature.data.bones[hand].use_inherit_rotation = False
    armature.pose.bones[fore].scale = (1.2, 1.2, 1.2)
    bpy.context.view_layer.update()


@pytest.mark.parametrize("naming", NAMES)
def test_bones_are_where_the_poses_say(naming):
    obj, armature = make_figure(naming, len(naming))
    obstruct(armature, naming)
    five_meshes.select(obj)
    assert bpy.ops.sinew.motion_range() == {"FINISHED"}
    bones = armature_io.read_bones(scenes.evaluated(armature))
    wanted = {pose.name: pose for pose in motion_range.poses(bones, {}, np.ones(len(bones.names), bool))}
    found = clip.poses_on(armature)
    assert [name for name, _frame in found] == list(wanted)
    for name, frame in found:
        bpy.context.scene.frame_set(frame)
        posed = battery.posed(bones, wanted[name])
        np.testing.assert_allclose(scenes.pose_of(armature), posed, atol=2e-5, err_msg=name)
        bpy.context.scene.frame_set(frame + clip.STEP)
        np.testing.assert_allclose(scenes.pose_of(armature), bones.rest, atol=2e-5, err_msg="at rest")


@pytest.mark.parametrize("keep", [False, True])
def test_all_comes_back(keep):
    obj, armature = make_figure("mixamo", 3)
    obstruct(armature, "mixamo")
    five_meshes.select(obj)
    scene = bpy.context.scene
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 3, 7
    scene.frame_set(4, subframe=0.5)
    before = whole_file.content()
    pose = scenes.pose_of(armature)
    bpy.ops.sinew.motion_range()
    scene.frame_set(clip.FIRST + clip.STEP)
    assert scenes.worst(scenes.pose_of(armature), pose) > 0.5
    assert bpy.ops.sinew.end_motion_range(keep=keep) == {"FINISHED"}
    np.testing.assert_allclose(scenes.pose_of(armature), pose, atol=1e-6)
    kept = [action for action in bpy.data.actions if clip.NAME in action.name]
    assert len(kept) == keep
    for action in kept:
        assert action.use_fake_user
        bpy.data.actions.remove(action)
    whole_file.assert_same(before)
    assert not bpy.ops.sinew.end_motion_range.poll()


def test_a_pose_that_differs_from_its_keys_comes_back():
    obj, armature = make_figure("mixamo", 5)
    obstruct(armature, "mixamo")
    five_meshes.select(obj)
    bone = armature.pose.bones[named("mixamo", "forearm", "L")]
    bone.location = (0.0, 0.9, 0.1)
    bpy.context.view_layer.update()
    pose = scenes.pose_of(armature)
    bpy.ops.sinew.motion_range()
    bpy.ops.sinew.end_motion_range()
    bpy.context.view_layer.update()
    assert tuple(bone.location) == pytest.approx((0.0, 0.9, 0.1))
    np.testing.assert_allclose(scenes.pose_of(armature), pose, atol=1e-6)


def test_a_rig_without_animation_has_none_afterwards():
    obj, armature = make_figure("unreal", 1)
    five_meshes.select(obj)
    before = whole_file.content()
    bpy.ops.sinew.motion_range()
    bpy.ops.sinew.end_motion_range()
    assert armature.animation_data is None
    whole_file.assert_same(before)


def test_a_saved_file_has_the_artists_own(tmp_path):
    obj, armature = make_figure("vrm", 2)
    obstruct(armature, "vrm")
    action = armature.animation_data.action.name
    five_meshes.select(obj)
    bpy.ops.sinew.motion_range()
    path = scenes.save(tmp_path / "figure.blend")
    assert not clip.armatures_on()
    text = f"""
import bpy
bpy.ops.wm.open_mainfile(filepath={str(path)!r})
rig = bpy.data.objects["Rig"]
print([a.name for a in bpy.data.actions], rig.animation_data.action.name, rig.animation_data.use_nla)
print([c.mute for b in rig.pose.bones for c in b.constraints])
"""
    done = run_script(tmp_path / "read.py", text).stdout
    assert f"['{action}'] {action} True" in done
    assert "[False]" in done


@pytest.mark.parametrize("how", ["start", "end", "keep"])
def test_each_operator_is_one_undo_step(how):
    obj, armature = make_figure("mixamo", 6)
    obstruct(armature, "mixamo")
    five_meshes.select(obj)
    bpy.context.scene.frame_set(4)
    if how != "start":
        bpy.ops.sinew.motion_range()

    def played() -> tuple[np.ndarray, np.ndarray, list[tuple[str, int]]]:
        rig = bpy.data.objects["Rig"]
        session.refresh(bpy.context)
        return scenes.pose_of(rig), scenes.final_points(bpy.data.objects["Body"]), clip.poses_on(rig)

    before, content = played(), whole_file.content()
    bpy.ops.ed.undo_push(message="before")
    # As a click: with the undo step that Blender pushes for the operator.
    if how == "start":
        assert bpy.ops.sinew.motion_range("EXEC_DEFAULT", True) == {"FINISHED"}
    else:
        assert bpy.ops.sinew.end_motion_range("EXEC_DEFAULT", True, keep=how == "keep") == {"FINISHED"}
    after = played()
    assert after[2] != before[2]
    for undone, wanted in ((True, before), (False, after)):
        (bpy.ops.ed.undo if undone else bpy.ops.ed.redo)()
        found = played()
        assert found[2] == wanted[2]
        for one, other in zip(found[:2], wanted[:2], strict=True):
            np.testing.assert_allclose(one, other, atol=1e-5)
        if undone:
            whole_file.assert_same(content, whole_file.BY_UNDO)


def test_a_saved_copy_has_the_artists_own_and_a_file_opened_again_nothing(tmp_path):
    _obj, armature = make_figure("vrm", 2)
    obstruct(armature, "vrm")
    action = armature.animation_data.action.name
    first = scenes.save(tmp_path / "first.blend")
    bpy.context.scene.frame_set(4)
    pose = scenes.pose_of(armature)
    for what in ("copy", "reload", "new"):
        five_meshes.select(bpy.data.objects["Body"])
        assert bpy.ops.sinew.motion_range() == {"FINISHED"}
        path = first
        if what == "copy":
            path = tmp_path / "copy.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
            assert not clip.armatures_on()
            np.testing.assert_allclose(scenes.pose_of(bpy.data.objects["Rig"]), pose, atol=1e-6)
        if what == "new":
            bpy.ops.wm.read_homefile(use_empty=True)
            assert not clip.armatures_on()
        bpy.ops.wm.open_mainfile(filepath=str(path))
        rig = bpy.data.objects["Rig"]
        assert not clip.armatures_on()
        assert not rig.is_property_set("sinew_motion_range")
        assert ([a.name for a in bpy.data.actions], rig.animation_data.action.name) == ([action], action)
        bpy.context.scene.frame_set(4)
        np.testing.assert_allclose(scenes.pose_of(rig), pose, atol=1e-6)


def test_what_can_not_play_one_says_why():
    obj, armature = make_figure("rigify", 4)
    five_meshes.select(obj)
    assert not bpy.ops.sinew.end_motion_range.poll()
    bpy.ops.sinew.motion_range()
    with pytest.raises(RuntimeError, match="plays its range of motion already"):
        bpy.ops.sinew.motion_range()
    bpy.ops.sinew.end_motion_range()
    scenes.enter(armature, "EDIT")
    with pytest.raises(RuntimeError, match="is in edit mode"):
        bpy.ops.sinew.motion_range()
