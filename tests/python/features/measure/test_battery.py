# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the battery of poses: joints bend by the stated angles, as limbs do, whatever a rig calls them."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from figures import LIMBS, NAMES, figure, rig
from sinew_addon.features.measure import battery


def poses_of(bones, limits=None):
    found = battery.Battery(bones, limits or {}, np.ones(len(bones.names), bool)).poses()
    return {pose.name: battery.posed(bones, pose) for pose in found}


def directions(posed):
    return posed[:, :3, 1]


def across(bones):
    """The same, whose bones stand across their limbs, all alike."""
    rest = bones.rest.copy()
    rest[:, :3, :3] = bones.rest[:, :3, [1, 2, 0]]
    return replace(bones, rest=rest)


@pytest.mark.parametrize("naming", NAMES)
def test_bones_across_their_limbs_bend_as_those_along_them(naming):
    bones, _number = figure(naming)
    stands = across(bones)
    np.testing.assert_allclose(stands.limbs.vectors, bones.limbs.vectors, atol=1e-6)
    expected, found = poses_of(bones), poses_of(stands)
    assert found.keys() == expected.keys()
    for name, pose in expected.items():
        motions = [each @ np.linalg.inv(of.rest) for each, of in ((pose, bones), (found[name], stands))]
        np.testing.assert_allclose(*motions, atol=1e-5, err_msg=name)


@pytest.mark.parametrize("naming", NAMES)
def test_a_figure_bends_as_people_do(naming):
    bones, number = figure(naming)
    poses = poses_of(bones)
    rest = bones.rest
    for side, out in (("L", 1.0), ("R", -1.0)):
        arm, fore, hand, thigh, shin = (
            number[name, side] for name in ("upper_arm", "forearm", "hand", "thigh", "shin")
        )
        elbow = directions(poses["Elbows bent"])
        assert math.degrees(math.acos(elbow[arm] @ elbow[fore])) == pytest.approx(130.0, abs=0.01)
        assert elbow[fore][1] < -0.7, "to the front"
        raised = directions(poses["Arms raised"])[arm]
        np.testing.assert_allclose(raised, (0.5 * out, 0.0, math.sin(math.radians(60.0))), atol=1e-5)
        squat = directions(poses["Squat"])
        assert squat[thigh][1] < -0.9, "the knee is in front"
        assert squat[shin][2] < -0.3, "the foot is below the knee"
        assert squat[shin][1] > squat[thigh][1]
        twisted = poses["Wrists twisted"][hand, :3, :3] @ rest[hand, :3, :3].T
        assert math.degrees(math.acos((np.trace(twisted) - 1) / 2)) == pytest.approx(150.0, abs=0.05)
        np.testing.assert_allclose(poses["Wrists twisted"][fore], rest[fore], atol=1e-6)
        # What a bone carries goes with it, and stays connected.
        tail = poses["Elbows bent"][fore] @ (0.0, bones.lengths[fore], 0.0, 1.0)
        np.testing.assert_allclose(tail[:3], poses["Elbows bent"][hand, :3, 3], atol=1e-6)
    turned = poses["Neck turned"][number["head", ""], :3, :3] @ rest[number["head", ""], :3, :3].T
    assert math.degrees(math.acos((np.trace(turned) - 1) / 2)) == pytest.approx(80.0, abs=0.05)


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("finger1-2.L", "thumb"),
        ("finger2-1.L", "finger"),
        ("LeftFingerBase", "still"),
        ("palm.01.L", "still"),
    ],
)
def test_hands_of_makehuman(name, role):
    assert next((role for role, names in battery._OTHERS if re.search(names, name.lower())), "") == role


def test_an_elbow_that_is_bent_at_rest_bends_as_far():
    slope = math.radians(40.0)
    wrist = (0.5 + 0.3 * math.cos(slope), -0.3 * math.sin(slope), 1.45)
    finger = (wrist[0] + 0.1 * math.cos(slope), wrist[1] - 0.1 * math.sin(slope), 1.45)
    limbs = LIMBS | {
        "forearm": ("upper_arm", (0.5, 0, 1.45), wrist),
        "hand": ("forearm", wrist, finger),
        "index": ("hand", finger, np.add(finger, (0.05, 0, 0))),
    }
    bones, number = figure(limbs=limbs)
    elbow = directions(poses_of(bones)["Elbows bent"])
    for side in "LR":
        arm, fore = number["upper_arm", side], number["forearm", side]
        assert math.degrees(math.acos(elbow[arm] @ elbow[fore])) == pytest.approx(130.0, abs=0.01)
        assert elbow[fore][1] < -0.7, "to the front"


def test_limits_come_first():
    bones, number = figure()
    limit = np.array([[-0.2, 1.2], [0.0, 0.0], [0.0, 0.0]])
    poses = poses_of(bones, {"DEF-forearm.L": limit})
    fore = number["forearm", "L"]
    np.testing.assert_allclose(poses["Elbows bent"][fore], bones.rest[fore], atol=1e-6)
    for name, angle in (("X least", 0.2), ("X most", 1.2)):
        assert battery.bend_angles(bones, poses[name])[fore] == pytest.approx(angle, abs=1e-4)
    assert "Y most" not in poses


def test_what_has_no_name_swings_and_twists():
    chain = {f"bone.{k}": (f"bone.{k - 1}" if k else "", (k, 0, 0), (k + 1, 0, 0)) for k in range(5)}
    bones = rig(chain)
    poses = poses_of(bones)
    largest = np.max([battery.bend_angles(bones, pose) for pose in poses.values()], axis=0)
    np.testing.assert_allclose(np.degrees(largest), [0.0, 90.0, 90.0, 90.0, 90.0], atol=0.01)
    assert len(poses) == 6


def test_a_beast_is_no_figure():
    bones, _number = figure()
    # On all fours.
    lying = bones.rest.copy()
    lying[:4, :3, 3] = [(0, 0, 1), (0, -0.3, 1), (0, -0.6, 1), (0, -0.9, 1)]
    lying[4, :3, 3] = (0, -1.0, 1)
    assert "Squat" not in poses_of(replace(bones, rest=lying))
