# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects inverse kinematics by Blender's constraints. The oracle is Blender's own solver where the solution
is unique, elsewhere the target."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import scenes
from future_work import chains, constraints, ik
from mathutils import Matrix, Vector
from sinew_addon.base.errors import SinewError

pytestmark = pytest.mark.long_term

FRAMES = range(1, 25)


@pytest.fixture(autouse=True)
def empty_file():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def make_empty(name, places):
    empty = scenes.added(name, None)
    frames = (1, 9, 17, 24)
    scenes.key(empty, "location", zip(frames, places, strict=False))
    scenes.key(empty, "rotation_euler", [(frame, (0.1 * frame, 0.03 * frame, 0.0)) for frame in frames])
    return empty


def make_arm(count=2, lean=0.25):
    """A base bone, a chain of `count` bones up Z, slightly bent, and a hand parented to it; in an object
    that is moved, rotated and scaled."""
    arm = scenes.added("Arm", bpy.data.armatures.new("Arm"))
    bpy.context.view_layer.objects.active = arm
    arm.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    parent, head = None, Vector()
    for number, name in enumerate(["base", *(f"arm.{i}" for i in range(count)), "hand"]):
        bone = arm.data.edit_bones.new(name)
        turn = Matrix.Rotation(lean * (-1) ** number, 3, "X")
        bone.head, bone.tail = head, head + turn @ Vector((0.0, 0.0, 1.0 if number else 0.4))
        bone.parent, bone.use_connect = parent, number > 1
        parent, head = bone, bone.tail.copy()
    bpy.ops.object.mode_set(mode="OBJECT")
    for bone in arm.pose.bones:
        bone.rotation_mode = "QUATERNION"
    arm.matrix_world = Matrix.LocRotScale(
        (0.3, -0.2, 0.5), Matrix.Rotation(0.4, 3, "Z").to_quaternion(), (1.5,) * 3
    )
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = FRAMES[0], FRAMES[-1]
    return arm


def constrain(arm, bone, target, pole=None, pole_angle=0.0, **settings):
    constraint = arm.pose.bones[bone].constraints.new("IK")
    constraint.target = target
    if pole is not None:
        constraint.pole_target, constraint.pole_angle = pole, pole_angle
    for name, value in {"chain_count": 2, **settings}.items():
        setattr(constraint, name, value)
    return constraint


def near(*, scale=1.0):
    return [Vector(p) * scale for p in ((0.9, 0.8, 2.2), (-0.6, 0.5, 2.9), (0.2, -1.0, 1.9), (1.1, 0.3, 2.6))]


def poses(arm, names, frames=FRAMES):
    """[frames, bones, 4, 4], world space."""
    numbers = [arm.pose.bones.find(name) for name in names]
    return scenes.at_frames(
        frames, lambda: np.array(scenes.evaluated(arm).matrix_world) @ scenes.pose_of(arm)[numbers]
    )


def places(empty, frames=FRAMES):
    return scenes.at_frames(frames, lambda: np.array(scenes.evaluated(empty).matrix_world.translation))


def solved(arm):
    """By bone, [frames, 4, 4] in world space: what the solver makes of the constraints, which end muted."""
    found = {}
    for tree in constraints.read_trees(arm):
        constraints.set_muted(arm, tree.constraints, True)
        posed = []
        for frame in FRAMES:
            bpy.context.scene.frame_set(frame)
            posed.append(constraints.read_posed(arm, tree))
        posed = chains.stack(posed)
        problem = chains.problem_of(tree, posed)
        rotations = chains.blended(tree, problem, chains.solve(tree, problem).rotations, posed.influences)
        matrices = np.array(arm.matrix_world) @ chains.matrices_of(tree, problem, rotations)
        found |= dict(zip(tree.bones, np.moveaxis(matrices, 1, 0), strict=True))
    return found


def tails(arm, name, matrices):
    return matrices[:, :3, 1] * arm.data.bones[name].length + matrices[:, :3, 3]


def test_a_pole_decides_two_bones_as_in_blender():
    arm = make_arm()
    target, pole = make_empty("Target", near()), make_empty("Pole", [(2, 3, 3), (1, 3, 2), (2, 2, 4)])
    constrain(arm, "arm.1", target, pole, -0.7, iterations=2000)
    names = ["arm.0", "arm.1"]
    before = poses(arm, names)
    found = solved(arm)
    # Blender stops at steps of a thousandth; the solution is unique here.
    np.testing.assert_allclose(np.stack([found[name] for name in names], axis=1), before, atol=5e-3)
    np.testing.assert_allclose(tails(arm, "arm.1", found["arm.1"]), places(target), atol=1e-5)


def test_hinges_with_limits_bend_as_in_blender():
    arm = make_arm()
    knee = arm.pose.bones["arm.1"]
    knee.lock_ik_y = knee.lock_ik_z = True
    knee.use_ik_limit_x, knee.ik_min_x, knee.ik_max_x = True, 0.0, 2.5
    target, pole = make_empty("Target", near(scale=0.9)), make_empty("Pole", [(2, 3, 3)])
    constrain(arm, "arm.1", target, pole, 0.4, iterations=2000)
    names = ["arm.0", "arm.1"]
    before = poses(arm, names)
    tree = constraints.read_trees(arm)[0]
    assert tree.locked.tolist() == [[False] * 3, [False, True, True]]
    found = solved(arm)
    np.testing.assert_allclose(tails(arm, "arm.1", found["arm.1"]), places(target), atol=1e-5)
    np.testing.assert_allclose(np.stack([found[name] for name in names], axis=1), before, atol=1e-2)
    for first, second in zip(*(found[name] for name in names), strict=True):
        own = Matrix(tree.rest[1]).inverted() @ Matrix(first).to_3x3().inverted() @ Matrix(second).to_3x3()
        angles = ik.swing_twist_angles(np.array(own.to_quaternion()))
        assert -1e-5 <= angles[0] <= 2.5 + 1e-5
        assert np.abs(angles[1:]).max() < 1e-5


def test_rotation_is_followed_and_scaled_bones_reach():
    arm = make_arm(4)
    arm.pose.bones["arm.1"].scale = (1.3, 1.3, 1.3)
    arm.pose.bones["base"].scale = (0.8, 0.8, 0.8)
    arm.data.bones["arm.2"].inherit_scale = "NONE"
    target = make_empty("Target", near())
    constrain(arm, "arm.3", target, chain_count=4, use_rotation=True)
    found = solved(arm)["arm.3"]
    np.testing.assert_allclose(tails(arm, "arm.3", found), places(target), atol=1e-4)
    for frame, matrix in zip(FRAMES, found, strict=True):
        bpy.context.scene.frame_set(frame)
        wanted = scenes.evaluated(target).matrix_world.to_quaternion()
        turn = Matrix(matrix).to_quaternion().rotation_difference(wanted).angle
        assert min(turn, 2 * math.pi - turn) < 1e-3


def test_one_tree_of_two_constraints_and_a_bone_as_target():
    arm = make_arm(1)
    bpy.ops.object.mode_set(mode="EDIT")
    for side in (-1, 1):
        parent = arm.data.edit_bones["arm.0"]
        for number in range(2):
            bone = arm.data.edit_bones.new(f"branch.{side}.{number}")
            bone.head = parent.tail
            bone.tail = bone.head + Vector((0.8 * side, 0.2 * (-1) ** number, 0.5))
            bone.parent, bone.use_connect = parent, True
            parent = bone
        control = arm.data.edit_bones.new(f"control.{side}")
        control.head = parent.tail + Vector((-0.4 * side, 0.4, 0.3))
        control.tail = control.head + Vector((0, 0.2, 0))
    bpy.ops.object.mode_set(mode="OBJECT")
    for side in (-1, 1):
        constraint = constrain(arm, f"branch.{side}.1", arm, chain_count=4)
        constraint.subtarget = f"control.{side}"
    trees = constraints.read_trees(arm)
    assert len(trees) == 1
    assert len(trees[0].effectors) == 2
    assert trees[0].bones[0] == "base"
    found = solved(arm)
    for side in (-1, 1):
        at = arm.matrix_world @ arm.pose.bones[f"control.{side}"].head
        name = f"branch.{side}.1"
        np.testing.assert_allclose(tails(arm, name, found[name])[11], at, atol=1e-4)


def test_influence_lies_between():
    arm = make_arm()
    constraint = constrain(arm, "arm.1", make_empty("Target", near()))
    constraint.influence = 0.4
    before = tails(arm, "arm.1", poses(arm, ["arm.1"])[:, 0])
    np.testing.assert_allclose(tails(arm, "arm.1", solved(arm)["arm.1"]), before, atol=5e-3)


def test_only_chains_with_selected_bones():
    arm = make_arm(3)
    constrain(arm, "arm.2", make_empty("Target", near()), chain_count=2)
    assert constraints.read_trees(arm, ["arm.1"])[0].bones == ("arm.1", "arm.2")
    with pytest.raises(SinewError, match="no inverse kinematics constraint that moves a selected bone"):
        constraints.read_trees(arm, ["base"])


def test_what_it_does_not_do_is_said():
    arm = make_arm()
    with pytest.raises(SinewError, match="no inverse kinematics constraint; add one"):
        constraints.read_trees(arm)
    constrain(arm, "arm.1", make_empty("Target", near()))
    arm.pose.bones["arm.0"].ik_stretch = 0.5
    with pytest.raises(SinewError, match=r"arm\.0 may stretch"):
        constraints.read_trees(arm)
    arm.pose.bones["arm.0"].ik_stretch = 0.0
    arm.pose.bones["arm.0"].constraints.new("LIMIT_ROTATION")
    with pytest.raises(SinewError, match="has the constraint Limit Rotation besides"):
        constraints.read_trees(arm)
