# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the battery of poses: joints bend by the stated angles, as limbs do, whatever a rig calls them."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from sinew_addon.features.measure import battery
from sinew_addon.skinning.rig import Bones

# Parent, head and tail of a figure that faces -Y, its left at +X.
TRUNK = {
    "hips": ("", (0, 0, 1.0), (0, 0, 1.1)),
    "spine": ("hips", (0, 0, 1.1), (0, 0, 1.3)),
    "chest": ("spine", (0, 0, 1.3), (0, 0, 1.5)),
    "neck": ("chest", (0, 0, 1.5), (0, 0, 1.6)),
    "head": ("neck", (0, 0, 1.6), (0, 0, 1.8)),
}
LIMBS = {
    "upper_arm": ("chest", (0.2, 0, 1.45), (0.5, 0, 1.45)),
    "forearm": ("upper_arm", (0.5, 0, 1.45), (0.8, 0, 1.45)),
    "hand": ("forearm", (0.8, 0, 1.45), (0.9, 0, 1.45)),
    "index": ("hand", (0.9, 0, 1.45), (0.95, 0, 1.45)),
    "thigh": ("hips", (0.1, 0, 1.0), (0.1, 0, 0.5)),
    "shin": ("thigh", (0.1, 0, 0.5), (0.1, 0, 0.1)),
    "foot": ("shin", (0.1, 0, 0.1), (0.1, -0.15, 0.0)),
}
NAMES = {
    "rigify": "DEF-{name}{.S}",
    "unreal": "{name}{_s}",
    "mixamo": "mixamorig:{Side}{Name}",
    "vrm": "J_Bip_{X}_{Name}",
    "makehuman": "{name}{.S}",
    "auto_rig": "{name}{.x}",
}
# What rigs call the bones; others have their plain names.
OTHERS = {
    "rigify": {
        **{"hips": "spine", "spine": "spine.001", "chest": "spine.003", "neck": "spine.004"},
        **{"head": "spine.006", "index": "f_index.01"},
    },
    "unreal": {
        **{"hips": "pelvis", "spine": "spine_01", "chest": "spine_02", "upper_arm": "upperarm"},
        **{"forearm": "lowerarm", "shin": "calf", "index": "index_01"},
    },
    "mixamo": {
        **{"chest": "spine1", "upper_arm": "arm", "forearm": "ForeArm", "thigh": "UpLeg"},
        **{"shin": "leg", "index": "HandIndex1"},
    },
    "vrm": {
        **{"upper_arm": "UpperArm", "forearm": "LowerArm", "thigh": "UpperLeg", "shin": "LowerLeg"},
        **{"index": "Index1"},
    },
    "makehuman": {
        **{"hips": "root", "spine": "spine05", "chest": "spine01", "neck": "neck01"},
        **{"upper_arm": "upperarm01", "forearm": "lowerarm01", "hand": "wrist", "thigh": "upperleg01"},
        **{"shin": "lowerleg01", "index": "finger2-1"},
    },
    "auto_rig": {
        **{"hips": "root", "spine": "spine_01", "chest": "spine_02", "upper_arm": "arm_stretch"},
        **{"forearm": "forearm_stretch", "thigh": "thigh_stretch", "shin": "leg_stretch", "index": "index1"},
    },
}


def named(naming, name, side):
    """side: L, R or empty"""
    name = OTHERS[naming].get(name, name)
    words = {"L": "Left", "R": "Right", "": ""}
    values = {
        **{"{name}": name, "{Name}": name[0].upper() + name[1:], "{Side}": words[side], "{X}": side or "C"},
        **{"{.S}": f".{side}" if side else "", "{_s}": f"_{side.lower()}" if side else ""},
        "{.x}": f".{side.lower() or 'x'}",
    }
    made = NAMES[naming]
    for place, value in values.items():
        made = made.replace(place, value)
    return made


def rig(bones):
    """bones: parent, head and tail by name."""
    names, count = tuple(bones), len(bones)
    rest = np.tile(np.identity(4, np.float32), (count, 1, 1))
    lengths = np.zeros(count, np.float32)
    for number, (_parent, head, tail) in enumerate(bones.values()):
        along = np.subtract(tail, head)
        lengths[number] = np.linalg.norm(along)
        y = along / lengths[number]
        x = np.cross(y, (0.3, 0.5, 0.8))
        x /= np.linalg.norm(x)
        rest[number, :3, :3] = np.stack([x, y, np.cross(x, y)], axis=1)
        rest[number, :3, 3] = head
    parents = np.array([names.index(parent) if parent else -1 for parent, *_rest in bones.values()], np.int32)
    made = replace(Bones.none(), names=names, deform=np.ones(count, bool), rest=rest, lengths=lengths)
    first = np.full(count, -1, np.int32)
    return replace(made, segments=np.ones(count, np.int32), first_joints=first, parents=parents)


def figure(naming="rigify", limbs=LIMBS):
    """Returns the bones, and the number of each by its plain name and side."""
    made, plain = {}, {}
    for side, sign in (("", 1), ("L", 1), ("R", -1)):
        for name, (parent, head, tail) in (limbs if side else TRUNK).items():
            own = named(naming, name, side)
            mirrored = [tuple(np.multiply(point, (sign, 1, 1))) for point in (head, tail)]
            above = named(naming, parent, side if parent in LIMBS else "") if parent else ""
            plain[name, side] = len(made)
            made[own] = (above, *mirrored)
    return rig(made), plain


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
