# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the range of motion: joints of any naming bend by the stated angles, in the stated directions, and
the columns of a contact sheet are of one side."""

import math

import numpy as np
import pytest
from figures import NAMES, TRUNK, figure
from sinew_addon.features.measure import battery, motion_range


def poses_of(bones):
    found = motion_range.poses(bones, {}, np.ones(len(bones.names), bool))
    return {pose.name: battery.posed(bones, pose) for pose in found}


def angle(a, b):
    return math.degrees(math.acos(np.clip(a @ b, -1.0, 1.0)))


@pytest.mark.parametrize("naming", NAMES)
def test_joints_bend_by_the_stated_angles(naming):
    bones, number = figure(naming)
    poses, rest = poses_of(bones), bones.rest
    for side in "LR":
        arm, fore, hand, thigh, shin = (
            number[name, side] for name in ("upper_arm", "forearm", "hand", "thigh", "shin")
        )
        elbow = poses["Elbows bent"][:, :3, 1]
        assert angle(elbow[arm], elbow[fore]) == pytest.approx(130.0, abs=0.05)
        assert elbow[fore][1] < 0.0, "forwards"
        knee = poses["Knees bent"][:, :3, 1]
        assert angle(knee[thigh], knee[shin]) == pytest.approx(130.0, abs=0.05)
        assert knee[shin][1] > 0.5, "backwards"
        assert poses["Legs back"][thigh, 1, 1] > 0.4
        for name, sign in (("Wrists twisted", 1), ("Wrists twisted back", -1)):
            motion = poses[name][hand, :3, :3] @ rest[hand, :3, :3].T
            assert math.degrees(math.acos((np.trace(motion) - 1) / 2)) == pytest.approx(150.0, abs=0.05)
            axis = np.array(
                [motion[2, 1] - motion[1, 2], motion[0, 2] - motion[2, 0], motion[1, 0] - motion[0, 1]]
            )
            assert sign * (1 if side == "L" else -1) * (axis @ rest[hand, :3, 1]) > 0.0, "the sides mirror"
    head = number["head", ""]
    turned = poses["Neck turned"][head, :3, :3] @ rest[head, :3, :3].T
    assert math.degrees(math.acos((np.trace(turned) - 1) / 2)) == pytest.approx(70.0, abs=0.05)


def test_limits_of_bones_do_not_change_the_stated_angles():
    bones, number = figure(next(iter(NAMES)))
    fore, arm = number["forearm", "L"], number["upper_arm", "L"]
    limits = {bones.names[fore]: np.radians([[-10.0, 10.0]] * 3)}
    found = motion_range.poses(bones, limits, np.ones(len(bones.names), bool))
    pose = next(battery.posed(bones, each) for each in found if each.name == "Elbows bent")[:, :3, 1]
    assert angle(pose[arm], pose[fore]) == pytest.approx(130.0, abs=0.05)


@pytest.mark.parametrize("naming", NAMES)
def test_columns_bend_one_side(naming):
    bones, number = figure(naming)
    columns = motion_range.columns(bones, np.ones(len(bones.names), bool))
    by_joint = {each.joint: each for each in columns}
    assert list(by_joint)[:5] == ["Elbow", "Wrist", "Shoulder", "Hip", "Knee"]
    assert by_joint["Elbow"].bones == (number["forearm", "L"],)
    assert set(by_joint["Elbow"].pose.rotations) == {number["forearm", "L"]}
    assert number["thigh", "R"] not in by_joint["Hip"].pose.rotations
    # The arms are out of the way.
    assert {number["upper_arm", side] for side in "LR"} <= set(by_joint["Hip"].pose.rotations)


def test_columns_leave_other_bones():
    """A tail, which has no role, stays."""
    tail = {
        "tail": ("hips", (0, 0.1, 1.0), (0, 0.4, 1.0)),
        "tail_tip": ("tail", (0, 0.4, 1.0), (0, 0.7, 1.0)),
    }
    bones, number = figure("unreal", trunk={**TRUNK, **tail})
    columns = motion_range.columns(bones, np.ones(len(bones.names), bool))
    assert len(columns) == 8
    tails = {number[name, ""] for name in tail}
    assert not any(tails & set(each.pose.rotations) for each in columns)
