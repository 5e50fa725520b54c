# SPDX-License-Identifier: GPL-3.0-or-later
"""Live inverse kinematics: the oracle is the bake of the same trees, frame by frame, and what is
evaluated with and after the bones: children, meshes, renders."""

from __future__ import annotations

import math
import subprocess
import sys
from typing import ClassVar

import bpy
import numpy as np
import pytest
import scenes
import sinew
import sinew_addon
from mathutils import Matrix, Vector
from sinew_addon import cli
from sinew_addon.attach import properties
from sinew_addon.attach.subscribers import notify, subscribers
from sinew_addon.core.errors import SinewError
from sinew_addon.deform import safe_mode, session
from sinew_addon.deform.plan import State
from sinew_addon.features.ik import ik_bake, ik_handlers, ik_in_depsgraph, ik_live
from sinew_addon.features.ik.ik_records import live_constraints
from sinew_addon.io import ik_io
from test_ik import FRAMES, bake, constrain, make_arm, make_empty, near, places, poses, tails

POLE = [(2, 3, 3), (1, 3, 2), (2, 2, 4)]


def live(armature=None):
    assert bpy.ops.sinew.live_ik() == {"FINISHED"}
    armature = armature or bpy.context.object
    assert ik_live.problem_of(armature) == ""


def followers():
    return [obj for obj in bpy.data.objects if obj.type == "ARMATURE" and obj.sinew_ik_is_follower]


def key_pose(arm, names=("base", "arm.0", "arm.1")):
    """Keys under the constraint, which determine the solver's start and the rest of an influence below 1."""
    for frame, angle in ((1, 0.1), (24, 0.5)):
        for number, name in enumerate(names):
            bone = arm.pose.bones[name]
            rotation = Matrix.Rotation(angle * (number + 1) / 2, 3, "XYZ"[number % 3])
            if bone.rotation_mode == "QUATERNION":
                bone.rotation_quaternion = rotation.to_quaternion()
                bone.keyframe_insert("rotation_quaternion", frame=frame)
            else:
                bone.rotation_euler = rotation.to_euler(bone.rotation_mode)
                bone.keyframe_insert("rotation_euler", frame=frame)


def of_object():
    arm = make_arm(4)
    key_pose(arm)
    constrain(arm, "arm.3", make_empty("Target", near(scale=1.3)), chain_count=4)
    return arm


def with_pole():
    arm = make_arm(mode="XYZ")
    key_pose(arm)
    constraint = constrain(arm, "arm.1", make_empty("Target", near()), make_empty("Pole", POLE), -0.7)
    for frame, influence in ((1, 0.0), (12, 1.0), (24, 0.3)):
        constraint.influence = influence
        constraint.keyframe_insert("influence", frame=frame)
    return arm


def with_limits():
    """Two hinges and a pole: the solution is unique."""
    arm = make_arm()
    knee = arm.pose.bones["arm.1"]
    knee.lock_ik_y = knee.lock_ik_z = True
    knee.use_ik_limit_x, knee.ik_min_x, knee.ik_max_x = True, 0.0, 2.5
    constrain(arm, "arm.1", make_empty("Target", near(scale=0.9)), make_empty("Pole", POLE[:1]), 0.4)
    return arm


def scaled_evenly():
    arm = make_arm(4, mode="ZXY")
    key_pose(arm)
    arm.pose.bones["arm.1"].scale = (1.3, 1.3, 1.3)
    arm.pose.bones["base"].scale = (0.8, 0.8, 0.8)
    arm.pose.bones["arm.0"].location = (0.1, 0.2, -0.1)
    constraint = constrain(arm, "arm.3", make_empty("Target", near()), chain_count=4, use_rotation=True)
    constraint.influence = 0.6
    return arm


def scaled_unevenly():
    arm = make_arm(3)
    arm.pose.bones["arm.0"].scale = (1.0, 1.2, 0.9)
    constrain(arm, "arm.2", make_empty("Target", near()), chain_count=3)
    return arm


def scaled_and_rotated():
    arm = make_arm(4)
    arm.pose.bones["arm.1"].scale = (1.3, 1.3, 1.3)
    arm.pose.bones["base"].scale = (0.8, 0.8, 0.8)
    arm.pose.bones["base"].location = (0.1, 0.2, -0.1)
    arm.data.bones["arm.2"].inherit_scale = "NONE"
    arm.data.bones["arm.3"].use_inherit_rotation = False
    constrain(arm, "arm.3", make_empty("Target", near()), chain_count=4, use_rotation=True)
    return arm


def branches():
    """Two constraints pull one tree to bones of the same armature, which move; a third tree is attached
    to it."""
    arm = make_arm(1)
    bpy.ops.object.mode_set(mode="EDIT")
    bones = arm.data.edit_bones
    for side in (-1, 1):
        parent = bones["arm.0"]
        for number in range(4):
            bone = bones.new(f"branch.{side}.{number}")
            bone.head = parent.tail
            bone.tail = bone.head + Vector((0.8 * side, 0.2 * (-1) ** number, 0.5))
            bone.parent, bone.use_connect = parent, True
            parent = bone
        for name, number in (("control", 1), ("end", 3)):
            at = bones[f"branch.{side}.{number}"].tail
            control = bones.new(f"{name}.{side}")
            control.head = at + Vector((-0.4 * side, 0.4, 0.3))
            control.tail = control.head + Vector((0, 0.2, 0))
    bpy.ops.object.mode_set(mode="OBJECT")
    for side in (-1, 1):
        for name, tip, count in (("control", 1, 4), ("end", 3, 2)):
            constraint = constrain(arm, f"branch.{side}.{tip}", arm, chain_count=count)
            constraint.subtarget = f"{name}.{side}"
            control = arm.pose.bones[f"{name}.{side}"]
            for frame, shift in ((1, -0.3), (24, 0.3)):
                control.location = (shift * side, 0.1, shift - 0.5)
                control.keyframe_insert("location", frame=frame)
    return arm


SCENES = (of_object, with_pole, with_limits, scaled_evenly, scaled_unevenly, scaled_and_rotated, branches)


class Recorder(bpy.types.RenderEngine):
    """A render engine that stores the bones in the render's own dependency graph."""

    bl_idname = "SINEW_TEST_RECORDER"
    bl_label = "Recorder"

    seen: ClassVar = {}

    def render(self, depsgraph):
        assert depsgraph.mode == "RENDER"
        frame = depsgraph.scene.frame_current
        self._keep(depsgraph, frame)
        # As for motion blur.
        self.frame_set(frame, 0.4)
        self._keep(depsgraph, frame + 0.4)
        self.frame_set(frame, 0.0)

    def _keep(self, depsgraph, frame):
        for obj in depsgraph.objects:
            if obj.type == "ARMATURE":
                bones = {bone.name: np.array(obj.matrix_world @ bone.matrix) for bone in obj.pose.bones}
                self.seen[obj.name, frame] = bones
            if obj.type == "MESH":
                points = [obj.matrix_world @ vertex.co for vertex in obj.data.vertices]
                self.seen[obj.name, frame] = np.array(points)


@pytest.fixture
def recorder():
    bpy.utils.register_class(Recorder)
    scene = bpy.context.scene
    scene.render.engine = Recorder.bl_idname
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    Recorder.seen.clear()
    yield Recorder.seen
    scene.render.engine = "CYCLES"
    bpy.utils.unregister_class(Recorder)


@pytest.mark.parametrize("method", sinew.ik.METHODS)
@pytest.mark.parametrize("make", SCENES)
def test_live_is_the_bake_at_every_frame(make, method):
    arm = make()
    names = [bone.name for bone in arm.pose.bones]
    blender = poses(arm, names)
    live(arm)
    arm.sinew_ik.method = method
    found = poses(arm, names)
    # What is shown is not Blender's solution.
    assert np.abs(found - blender).max() > 1e-5
    # Backwards, since no frame depends on the one before.
    np.testing.assert_allclose(poses(arm, names, FRAMES[::-1])[::-1], found, atol=1e-6)
    bake(method)
    assert not ik_live.is_live(arm)
    np.testing.assert_allclose(found, poses(arm, names), atol=2e-5)
    bpy.ops.sinew.remove_ik()
    np.testing.assert_allclose(poses(arm, names), blender, atol=1e-6)


@pytest.mark.parametrize("make", [with_pole, branches])
def test_a_render_has_the_pose_of_its_own_frame(make, recorder, tmp_path):
    arm = make()
    live(arm)
    names = [bone.name for bone in arm.pose.bones]
    expected = poses(arm, names)
    bpy.context.scene.frame_set(5)
    for frame in (23, 3, 11):
        bpy.context.scene.frame_set(frame)
        bpy.ops.render.render()
        found = [recorder[arm.name, frame][name] for name in names]
        np.testing.assert_allclose(found, expected[FRAMES.index(frame)], atol=1e-6)
        bpy.context.scene.frame_set(frame, subframe=0.4)
        evaluated = arm.evaluated_get(bpy.context.evaluated_depsgraph_get())
        blurred = [recorder[arm.name, frame + 0.4][name] for name in names]
        own = [evaluated.matrix_world @ evaluated.pose.bones[name].matrix for name in names]
        np.testing.assert_allclose(blurred, own, atol=1e-6)
        assert np.abs(np.array(blurred) - found).max() > 1e-4
    bpy.context.scene.frame_end = 6
    bpy.context.scene.render.filepath = str(tmp_path / "frame")
    recorder.clear()
    bpy.ops.render.render(animation=True)
    for frame in range(1, 7):
        found = [recorder[arm.name, frame][name] for name in names]
        np.testing.assert_allclose(found, expected[frame - 1], atol=1e-6)


def add_body(arm, name):
    """A tube of vertices along the chain, each with weights of two bones."""
    heads = [np.array(arm.data.bones[f"arm.{number}"].head_local) for number in (0, 1)]
    heads.append(np.array(arm.data.bones["arm.1"].tail_local))
    points, weights = [], []
    for ring in range(21):
        t = ring / 10
        along = min(int(t), 1)
        centre = heads[along] + (t - along) * (heads[along + 1] - heads[along])
        share = float(np.clip(1.5 - t, 0.0, 1.0))
        for side in range(8):
            angle = math.pi * side / 4
            points.append(centre + 0.2 * np.array([math.cos(angle), math.sin(angle), 0.0]))
            weights.append((share, 1.0 - share))
    faces = [
        (8 * ring + side, 8 * ring + (side + 1) % 8, 8 * ring + 8 + (side + 1) % 8, 8 * ring + 8 + side)
        for ring in range(20)
        for side in range(8)
    ]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(point) for point in points], [], faces)
    body = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(body)
    body.parent = arm
    for number in (0, 1):
        group = body.vertex_groups.new(name=f"arm.{number}")
        for vertex, row in enumerate(weights):
            if row[number] > 0.0:
                group.add([vertex], row[number], "REPLACE")
    modifier = body.modifiers.new("Armature", "ARMATURE")
    modifier.object = arm
    return body


def test_meshes_and_children_of_bones_follow_in_the_same_frame(recorder):
    arm = with_pole()
    sinews, blenders = add_body(arm, "Sinew's"), add_body(arm, "Blender's")
    hung = add_body(arm, "Hung")
    hung.modifiers.clear()
    hung.parent_type, hung.parent_bone = "BONE", "hand"
    scenes.add_sinew(sinews, "log")
    bodies = [sinews, blenders, hung]

    def shapes():
        found = []
        for frame in FRAMES:
            bpy.context.scene.frame_set(frame)
            graph = bpy.context.evaluated_depsgraph_get()
            of_frame = []
            for body in bodies:
                evaluated = body.evaluated_get(graph)
                of_frame.append([evaluated.matrix_world @ v.co for v in evaluated.data.vertices])
            found.append(of_frame)
        return np.array(found)

    bpy.context.view_layer.objects.active = arm
    before = shapes()
    live(arm)
    found = shapes()
    assert np.abs(found - before).max() > 1e-5
    for frame in (2, 17):
        bpy.context.scene.frame_set(frame)
        bpy.ops.render.render()
        rendered = np.array([recorder[body.name, frame] for body in bodies])
        np.testing.assert_allclose(rendered, found[frame - 1], atol=1e-6)
    bake()
    np.testing.assert_allclose(found, shapes(), atol=2e-5)


def now(arm, name="arm.1"):
    """The tip in world space, from the last evaluation."""
    bpy.context.view_layer.update()
    evaluated = arm.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array(evaluated.matrix_world @ evaluated.pose.bones[name].tail)


def test_what_is_moved_by_hand_is_followed_at_once():
    arm = make_arm(3)
    target = make_empty("Target", ())
    pole = make_empty("Pole", ())
    target.location, pole.location = near()[0], POLE[0]
    constraint = constrain(arm, "arm.2", target, pole, chain_count=3)
    live(arm)
    for place in near():
        target.location = place
        np.testing.assert_allclose(now(arm, "arm.2"), place, atol=1e-5)
    before = now(arm, "arm.0")
    pole.location = (-2.0, 1.0, 0.0)
    assert np.abs(now(arm, "arm.0") - before).max() > 0.05
    # The pose under the constraint determines which of the solutions it is.
    before = now(arm, "arm.1")
    arm.pose.bones["arm.2"].rotation_quaternion = Matrix.Rotation(1.2, 3, "X").to_quaternion()
    assert np.abs(now(arm, "arm.1") - before).max() > 1e-2
    np.testing.assert_allclose(now(arm, "arm.2"), target.location, atol=1e-5)
    arm.location.x += 0.5
    np.testing.assert_allclose(now(arm, "arm.2"), target.location, atol=1e-5)
    arm.pose.bones["base"].rotation_quaternion = Matrix.Rotation(0.4, 3, "Y").to_quaternion()
    np.testing.assert_allclose(now(arm, "arm.2"), target.location, atol=1e-5)
    # Settings of bones and of the muted constraint apply, without switching anything.
    arm.pose.bones["arm.1"].lock_ik_x = arm.pose.bones["arm.1"].lock_ik_z = True
    now(arm)
    local = arm.convert_space(
        pose_bone=arm.pose.bones["arm.1"],
        matrix=arm.pose.bones["arm.1"].matrix,
        from_space="POSE",
        to_space="LOCAL",
    ).to_quaternion()
    assert abs(local.x) < 1e-5
    assert abs(local.z) < 1e-5
    constraint.influence = 0.0
    assert np.abs(now(arm, "arm.2") - np.array(target.location)).max() > 0.1


def test_a_switch_of_the_rig_that_drives_the_influence():
    arm = make_arm()
    arm["ik"] = 0.0
    constraint = constrain(arm, "arm.1", make_empty("Target", near()))
    curve = constraint.driver_add("influence")
    variable = curve.driver.variables.new()
    variable.name = "var"
    variable.targets[0].id, variable.targets[0].data_path = arm, '["ik"]'
    curve.driver.expression = "var * 0.5"
    for frame, value in ((1, 0.0), (24, 2.0)):
        arm["ik"] = value
        arm.keyframe_insert('["ik"]', frame=frame)
    live(arm)
    found = poses(arm, ["arm.0", "arm.1"])
    bake()
    np.testing.assert_allclose(found, poses(arm, ["arm.0", "arm.1"]), atol=2e-5)
    assert np.abs(found[0] - found[-1]).max() > 0.1


def test_what_is_driven_of_the_bones_channels_is_where_it_starts():
    arm = make_arm(3)
    arm["bend"] = 0.0
    curve = arm.pose.bones["arm.1"].driver_add("rotation_quaternion", 1)
    variable = curve.driver.variables.new()
    variable.name = "var"
    variable.targets[0].id, variable.targets[0].data_path = arm, '["bend"]'
    curve.driver.expression = "var"
    for frame, value in ((1, -0.5), (24, 0.7)):
        arm["bend"] = value
        arm.keyframe_insert('["bend"]', frame=frame)
    constrain(arm, "arm.2", make_empty("Target", near()), chain_count=3)
    live(arm)
    found = poses(arm, ["arm.0", "arm.1", "arm.2"])
    again = poses(arm, ["arm.0", "arm.1", "arm.2"], FRAMES[::-1])
    np.testing.assert_allclose(again[::-1], found, atol=1e-6)
    np.testing.assert_allclose(tails(arm, "arm.2"), places(bpy.data.objects["Target"]), atol=1e-5)


def values_of(owner):
    """By name, the properties that an object or a bone has of its own and of add-ons, without empty
    groups, which reading them creates."""
    groups = [owner]
    if hasattr(owner, "bl_system_properties_get"):
        groups.append(owner.bl_system_properties_get() or {})
    found = {}
    for group in groups:
        for key, value in group.items():
            plain = value.to_dict() if hasattr(value, "to_dict") else value
            if plain != {}:
                found[key] = plain
    return found


def contents_of(arm):
    """Everything that removal must restore."""
    return (
        [values_of(owner) for owner in (arm, *arm.pose.bones)],
        [[(c.type, c.name, c.mute) for c in bone.constraints] for bone in arm.pose.bones],
        [np.array(bone.matrix_basis).round(6).tolist() for bone in arm.pose.bones],
        arm.animation_data is not None,
        sorted(each.name for each in (*bpy.data.objects, *bpy.data.armatures, *bpy.data.actions)),
        [bone.name for bone in arm.data.bones],
        arm.data.users,
    )


@pytest.mark.parametrize("make", [with_limits, branches])
def test_remove_leaves_no_trace(make):
    arm = make()
    bpy.context.scene.frame_set(3)
    before = contents_of(arm)
    live(arm)
    arm.sinew_ik.method, arm.sinew_ik.iterations = "ccd", 50
    bpy.context.scene.frame_set(9)
    assert all(c.mute for bone in arm.pose.bones for c in bone.constraints if c.type == "IK")
    assert len(followers()) == len(ik_io.read_trees(arm, None, live_constraints(arm)))
    assert bpy.ops.sinew.remove_ik() == {"FINISHED"}
    bpy.context.scene.frame_set(3)
    assert contents_of(arm) == before


def test_the_switch_is_of_the_selected_chains():
    arm = make_arm(4)
    lower = constrain(arm, "arm.1", make_empty("Low", near(scale=0.7)))
    upper = constrain(arm, "arm.3", make_empty("High", near(scale=1.3)))
    ik_live.switch_on(arm, ["arm.3"])
    assert (lower.mute, upper.mute) == (False, True)
    ik_live.switch_on(arm, ["arm.0"])
    np.testing.assert_allclose(tails(arm, "arm.3"), places(bpy.data.objects["High"]), atol=1e-5)
    np.testing.assert_allclose(tails(arm, "arm.1"), places(bpy.data.objects["Low"]), atol=1e-5)
    ik_live.switch_off(arm, ["arm.3"])
    assert (lower.mute, upper.mute) == (True, False)
    # Again with the button: either all of them are live, or all become live.
    live(arm)
    assert (lower.mute, upper.mute) == (True, True)
    live(arm)
    assert (lower.mute, upper.mute) == (False, False)
    assert followers() == []


def test_a_constraint_that_comes_later_pulls_the_same_tree():
    arm = branches()
    for name in ("branch.-1.3", "branch.1.3"):
        constraints = arm.pose.bones[name].constraints
        constraints.remove(constraints["IK"])
    later = arm.pose.bones["branch.1.1"].constraints["IK"]
    later.mute = True
    live(arm)
    now(arm, "branch.-1.1")
    later.mute = False
    now(arm, "branch.-1.1")
    live(arm)
    assert later.mute
    for side in (-1, 1):
        control = arm.matrix_world @ arm.pose.bones[f"control.{side}"].head
        np.testing.assert_allclose(now(arm, f"branch.{side}.1"), control, atol=1e-4)


def test_undo_and_redo():
    arm = with_pole()
    names = ["arm.0", "arm.1", "hand"]
    bpy.ops.ed.undo_push(message="before")
    before = poses(arm, names)
    bpy.ops.ed.undo_push(message="still before")
    live(arm)
    found = poses(arm, names)
    bpy.ops.ed.undo_push(message="live")
    bpy.data.objects["Target"].location.x += 0.01
    bpy.ops.ed.undo_push(message="moved")
    for _turn in range(2):
        bpy.ops.ed.undo()
        arm = bpy.data.objects["Arm"]
        assert ik_live.is_live(arm)
        np.testing.assert_allclose(poses(arm, names), found, atol=1e-6)
        bpy.ops.ed.undo()
        arm = bpy.data.objects["Arm"]
        assert not ik_live.is_live(arm)
        assert not arm.pose.bones["arm.1"].constraints[0].mute
        assert len(arm.pose.bones["arm.1"].constraints) == 1
        np.testing.assert_allclose(poses(arm, names), before, atol=1e-6)
        bpy.ops.ed.redo()
        arm = bpy.data.objects["Arm"]
        np.testing.assert_allclose(poses(arm, names), found, atol=1e-6)
        bpy.ops.ed.redo()
    assert len(followers()) == 1


def test_undo_of_what_a_handler_put_on_anew():
    """A second armature gets its own follower between two steps of undo."""
    arm = with_pole()
    live(arm)
    bpy.ops.ed.undo_push(message="live")
    bpy.ops.object.duplicate()
    copy = bpy.context.object
    bpy.context.view_layer.update()
    assert len(followers()) == 2
    assert ik_live.is_live(copy)
    np.testing.assert_allclose(poses(copy, ["arm.1"]), poses(arm, ["arm.1"]), atol=1e-6)
    bpy.ops.ed.undo_push(message="copied")
    bpy.data.objects["Target"].location.x += 0.01
    bpy.ops.ed.undo_push(message="moved")
    for step in ("undo", "undo", "redo", "redo", "undo"):
        getattr(bpy.ops.ed, step)()
        for obj in filter(ik_live.is_live, bpy.data.objects):
            assert ik_live.problem_of(obj) == ""
            place = places(bpy.data.objects["Target"], [12])
            np.testing.assert_allclose(tails(obj, "arm.1", [12]), place, atol=1e-5)


def test_undo_brings_no_follower_back_that_was_deleted():
    """Blender would continue with its evaluated copy in a view layer that was not shown meanwhile, which
    writes to bones that no longer exist: an occasional crash."""
    arm = with_pole()
    live(arm)
    found = poses(arm, ["arm.1"])
    deleted = {each.session_uid for each in followers()}
    bpy.ops.ed.undo_push(message="live")
    bpy.context.window.view_layer = bpy.context.scene.view_layers.new("Second")
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="second layer")
    live(arm)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="given back")
    bpy.ops.ed.undo()
    arm = bpy.data.objects["Arm"]
    assert ik_live.is_live(arm)
    assert len(followers()) == 1
    assert deleted.isdisjoint(each.session_uid for each in followers())
    for layer in bpy.context.scene.view_layers:
        bpy.context.window.view_layer = layer
        np.testing.assert_allclose(poses(arm, ["arm.1"]), found, atol=1e-6)


def test_a_saved_file_has_no_bones_of_a_follower_that_is_left(tmp_path):
    """Its constraint was deleted, so it no longer follows anything."""
    arm = with_pole()
    live(arm)
    constraints = arm.pose.bones["arm.1"].constraints
    constraints.remove(constraints["IK"])
    bpy.context.view_layer.update()
    assert not ik_live.is_live(arm)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert [each.name for each in bpy.data.armatures] == [bpy.data.objects["Arm"].data.name]


WITHOUT_SINEW = """
import bpy, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[-1])
arm = bpy.data.objects["Arm"]
print("ROW", [(c.type, c.mute) for b in arm.pose.bones for c in b.constraints])
print("ROW", sorted(o.name for o in bpy.data.objects), sorted(a.name for a in bpy.data.armatures))
for frame in (2, 12, 24):
    bpy.context.scene.frame_set(frame)
    print("ROW", *["%.6f" % x for x in (arm.matrix_world @ arm.pose.bones["arm.1"].matrix).translation])
"""


def test_a_saved_file_plays_by_blenders_constraint_and_goes_on_here(tmp_path):
    arm = with_pole()
    names = ["arm.0", "arm.1", "hand"]
    blender = poses(arm, names, [2, 12, 24])
    live(arm)
    arm.sinew_ik.iterations = 77
    found = poses(arm, names)
    path = str(tmp_path / "arm.blend")
    bpy.context.scene.frame_set(7)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    np.testing.assert_allclose(poses(arm, names), found, atol=1e-6)
    assert len(followers()) == 1
    printed = subprocess.run(
        [sys.executable, "-c", WITHOUT_SINEW, path], capture_output=True, text=True, check=False
    ).stdout.splitlines()
    rows = [line.removeprefix("ROW ") for line in printed if line.startswith("ROW ")]
    assert rows[0] == "[('IK', False)]"
    assert rows[1] == "['Arm', 'Pole', 'Target'] ['Arm']"
    alone = np.array([[float(x) for x in row.split()] for row in rows[2:5]])
    np.testing.assert_allclose(alone, blender[:, 1, :3, 3], atol=1e-5)
    bpy.ops.wm.open_mainfile(filepath=path)
    arm = bpy.data.objects["Arm"]
    assert ik_live.is_live(arm)
    assert arm.sinew_ik.iterations == 77
    assert arm.pose.bones["arm.1"].constraints[0].mute
    np.testing.assert_allclose(poses(arm, names), found, atol=1e-6)


def test_a_file_that_blender_saved_by_itself_goes_on(tmp_path):
    """As auto-save does, without Sinew's handlers: the file does not contain the follower."""
    arm = with_pole()
    names = ["arm.0", "arm.1", "hand"]
    live(arm)
    found = poses(arm, names)
    path = str(tmp_path / "arm.blend")
    ik_handlers.unsubscribe()
    try:
        bpy.ops.wm.save_as_mainfile(filepath=path)
    finally:
        ik_handlers.subscribe()
    bpy.ops.wm.open_mainfile(filepath=path)
    arm = bpy.data.objects["Arm"]
    assert len(followers()) == 1
    np.testing.assert_allclose(poses(arm, names), found, atol=1e-6)
    bpy.ops.sinew.remove_ik()
    assert [(c.type, c.mute) for c in arm.pose.bones["arm.1"].constraints] == [("IK", False)]
    assert sorted(armature.name for armature in bpy.data.armatures if armature.users) == ["Arm"]


def test_without_the_add_on_blenders_constraints_play():
    arm = with_pole()
    names = ["arm.0", "arm.1", "hand"]
    blender = poses(arm, names)
    live(arm)
    found = poses(arm, names)
    sinew_addon.unregister()
    try:
        assert [(c.type, c.mute) for c in arm.pose.bones["arm.1"].constraints] == [("IK", False)]
        assert [obj.name for obj in bpy.data.objects if obj.type == "ARMATURE"] == ["Arm"]
        np.testing.assert_allclose(poses(arm, names), blender, atol=1e-6)
    finally:
        sinew_addon.register()
    np.testing.assert_allclose(poses(arm, names), found, atol=1e-6)


def test_it_plays_on_keys_that_sinew_plays_in_between():
    arm = of_object()
    names = [bone.name for bone in arm.pose.bones]
    arm.sinew_inbetween = "dib"
    live(arm)
    found = poses(arm, names)
    np.testing.assert_allclose(tails(arm, "arm.3"), places(bpy.data.objects["Target"]), atol=1e-5)
    np.testing.assert_allclose(poses(arm, names, FRAMES[::-1])[::-1], found, atol=1e-6)


def test_changes_of_the_constraint_are_taken_over():
    arm = with_pole()
    constraint = arm.pose.bones["arm.1"].constraints["IK"]
    live(arm)
    other = make_empty("Other", near()[::-1])
    constraint.target = other
    constraint.influence = 1.0
    for fcurve in list(arm.animation_data.drivers):
        raise AssertionError(fcurve.data_path)
    bpy.context.scene.frame_set(12)
    other.location = near()[2]
    np.testing.assert_allclose(now(arm), other.matrix_world.translation, atol=1e-5)
    constraint.chain_count = 1
    now(arm)
    assert [b.name for b in arm.pose.bones if any(map(ik_io.follows, b.constraints))] == ["arm.1"]
    assert ik_live.problem_of(arm) == ""
    constraint.chain_count = 2
    constraint.name = "Reach"
    now(arm)
    arm.data.bones["arm.1"].name = "forearm"
    arm.data.bones["arm.0"].name = "upper"
    other.location = near()[0]
    np.testing.assert_allclose(now(arm, "forearm"), other.matrix_world.translation, atol=1e-5)
    assert ik_live.problem_of(arm) == ""
    # Switched on by hand, it is Blender's again.
    constraint.mute = False
    now(arm, "forearm")
    assert not ik_live.is_live(arm)
    assert not any(ik_io.follows(c) for b in arm.pose.bones for c in b.constraints)
    live(arm)
    arm.pose.bones["forearm"].constraints.remove(arm.pose.bones["forearm"].constraints["Reach"])
    now(arm, "forearm")
    assert not ik_live.is_live(arm)
    assert not any(len(b.constraints) for b in arm.pose.bones)


def test_what_can_not_be_live_is_said_and_blenders_constraint_plays():
    arm = make_arm()
    target = make_empty("Target", near())
    constraint = constrain(arm, "arm.1", target)
    live(arm)
    limit = arm.pose.bones["arm.0"].constraints.new("LIMIT_ROTATION")
    now(arm)
    assert "has the constraint Limit Rotation besides" in ik_live.problem_of(arm)
    assert not constraint.mute
    arm.pose.bones["arm.0"].constraints.remove(limit)
    now(arm)
    assert ik_live.problem_of(arm) == ""
    assert constraint.mute
    constraint.target, constraint.subtarget = arm, "hand"
    now(arm)
    assert "target hand hangs on the chain that it pulls" in ik_live.problem_of(arm)
    constraint.target, constraint.subtarget = target, ""
    other = constrain(arm, "hand", target, chain_count=2)
    now(arm)
    with pytest.raises(SinewError, match=r"arm\.1 is pulled by chains that begin at different bones"):
        ik_live.switch_on(arm)
    arm.pose.bones["hand"].constraints.remove(other)
    now(arm)
    assert ik_live.problem_of(arm) == ""
    # Errors in an evaluation.
    arm.pose.bones["arm.0"].scale.x = -1.0
    now(arm)
    now(arm)
    assert "mirrored by a scale below 0" in ik_live.problem_of(arm)
    assert not constraint.mute
    arm.pose.bones["arm.0"].scale.x = 1.0
    now(arm)
    assert not constraint.mute
    bpy.ops.sinew.remove_ik()
    live(arm)
    np.testing.assert_allclose(now(arm), places(target, [bpy.context.scene.frame_current])[0], atol=1e-5)
    constraint.keyframe_insert("mute", frame=1)
    with pytest.raises(SinewError, match="key its influence instead"):
        ik_live.switch_on(arm)


@pytest.mark.parametrize("event", ["update", "save"])
def test_a_deleted_bone_ends_its_tree(event, tmp_path):
    """The bone has the constraint; those above it must not follow any longer."""
    arm = make_arm()
    constrain(arm, "arm.1", make_empty("Target", near()))
    live(arm)
    bpy.ops.object.mode_set(mode="EDIT")
    arm.data.edit_bones.remove(arm.data.edit_bones["arm.1"])
    bpy.ops.object.mode_set(mode="OBJECT")
    if event == "update":
        bpy.context.view_layer.update()
    else:
        path = str(tmp_path / "arm.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        arm = bpy.data.objects["Arm"]
    assert not any(map(ik_io.follows, arm.pose.bones["arm.0"].constraints))
    assert not arm.sinew_ik_is_live
    assert followers() == []


def test_linked_armatures_and_overrides_are_refused(tmp_path):
    arm = make_arm()
    constrain(arm, "arm.1", make_empty("Target", near()))
    live(arm)
    path = str(tmp_path / "arm.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=True) as (_, to):
        to.objects = ["Arm"]
    linked = to.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    bpy.context.view_layer.update()
    assert not linked.pose.bones["arm.1"].constraints[0].mute
    with pytest.raises(SinewError, match="is linked"):
        ik_live.switch_on(linked)
    override = linked.override_create(remap_local_usages=True)
    bpy.context.view_layer.update()
    with pytest.raises(SinewError, match="is a library override"):
        ik_live.switch_on(override)
    assert not any(map(ik_io.follows, override.pose.bones["arm.1"].constraints))


def test_safe_mode_leaves_it_to_blender():
    arm = make_arm()
    constraint = constrain(arm, "arm.1", make_empty("Target", near()))
    blender = poses(arm, ["arm.0", "arm.1"])
    live(arm)
    try:
        safe_mode.set_forced(True)
        arm.update_tag()
        bpy.context.view_layer.update()
        assert not constraint.mute
        assert ik_live.problem_of(arm) == ik_live.SAFE_MODE
        np.testing.assert_allclose(poses(arm, ["arm.0", "arm.1"]), blender, atol=1e-6)
    finally:
        safe_mode.set_forced(None)
    # As the preference does.
    notify(subscribers.safe_mode_changed)
    assert constraint.mute
    assert ik_live.problem_of(arm) == ""


def test_a_deleted_armature_leaves_nothing_in_the_file(tmp_path):
    arm = make_arm()
    constrain(arm, "arm.1", make_empty("Target", near()))
    live(arm)
    bpy.ops.object.delete()
    bpy.context.view_layer.update()
    path = str(tmp_path / "empty.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert [obj.name for obj in bpy.data.objects] == ["Target"]
    assert len(bpy.data.armatures) == 0


def test_a_bake_of_one_live_tree_leaves_the_other_live():
    arm = make_arm(4)
    constrain(arm, "arm.1", make_empty("Low", near(scale=0.7)))
    upper = constrain(arm, "arm.3", make_empty("High", near(scale=1.3)))
    live(arm)
    with ik_live.suspended(arm):
        trees = ik_io.read_trees(arm, ["arm.0"])
        for _share in ik_bake.steps(arm, trees, list(FRAMES), "dls", []):
            pass
    assert ik_live.is_live(arm)
    assert upper.mute
    assert not any(map(ik_io.follows, arm.pose.bones["arm.1"].constraints))
    np.testing.assert_allclose(tails(arm, "arm.3"), places(bpy.data.objects["High"]), atol=1e-5)
    np.testing.assert_allclose(tails(arm, "arm.1"), places(bpy.data.objects["Low"]), atol=1e-5)
    bpy.ops.sinew.remove_ik()
    assert not upper.mute
    assert not ik_bake.is_baked(arm)
    assert ik_in_depsgraph.problems == {}


def test_the_command_solves_a_file_whose_chains_are_live(tmp_path, capfd):
    arm = make_arm(3)
    constrain(arm, "arm.2", make_empty("Target", near()), chain_count=3)
    live(arm)
    found = poses(arm, ["arm.0", "arm.1", "arm.2"])
    source = tmp_path / "arm.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    assert cli.main(["ik", str(source), "--out", str(tmp_path / "out"), "--compare"]) == 0
    assert "1 of 1 files solved" in capfd.readouterr().out
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "arm.blend"))
    arm = bpy.data.objects["Arm"]
    assert not ik_live.is_live(arm)
    assert ik_bake.is_baked(arm)
    np.testing.assert_allclose(poses(arm, ["arm.0", "arm.1", "arm.2"]), found, atol=2e-5)


@pytest.mark.parametrize("end", ["removed", "fails", "fails at a frame"])
@pytest.mark.parametrize("keyed", [False, True], ids=["in depsgraph", "after update"])
def test_meshes_follow_the_end_of_live(none_left_to_blender, keyed, end):
    """Keys of the visibility have Sinew deform after the update, which no event announces here."""
    obj, armature = scenes.make_arm()
    target = make_empty("Target", [(1.0, 1.0, 0.5)])
    bone = next(each for each in armature.pose.bones if each.parent)
    bone.constraints.new("IK").target = target
    scenes.add_sinew(obj, "lbs")
    if keyed:
        modifier = next(each for each in obj.modifiers if each.type == "ARMATURE")
        modifier.show_viewport = True
        modifier.keyframe_insert("show_viewport", frame=1)
    if end == "fails at a frame":
        for frame, scale in ((3, 1.0), (4, -1.0)):
            bone.scale.x = scale
            bone.keyframe_insert("scale", index=0, frame=frame)
    bpy.context.view_layer.objects.active = armature
    bpy.context.scene.frame_set(2)
    live(armature)
    bpy.context.view_layer.update()
    assert (session.state_of(obj).plan.state is State.AFTER_UPDATE) == keyed
    if end == "removed":
        bone.constraints.remove(next(each for each in bone.constraints if each.type == "IK"))
    elif end == "fails":
        bone.scale.x = -1.0
    else:
        bpy.context.scene.frame_set(5)
    bpy.context.view_layer.update()
    assert not any(map(ik_io.follows, armature.pose.bones[bone.name].constraints))
    shown = scenes.final_points(obj)
    properties.of(obj).enabled = False
    bpy.context.view_layer.update()
    np.testing.assert_allclose(shown, scenes.final_points(obj), atol=1e-5)
