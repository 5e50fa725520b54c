# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects diagnostics: they find planted faults and no others; what they report about dual quaternions is
true."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
import reference
from rigs import about, random_rig
from sinew_addon.features.measure.diagnostics import PoseCheck, check_weights
from sinew_addon.skinning.influences import GroupWeights, Influences, entries_of_bones
from sinew_addon.skinning.rig import Bones, Weighting
from sinew_addon.skinning.vectors import rotations_of

NAMES = ("root", "arm", "hand", "finger", "thumb", "tip")


def findings_of(groups, group_names=NAMES):
    """groups: for each vertex a list of (group, weight)."""
    weights = GroupWeights(
        np.array([len(entries) for entries in groups], np.int32),
        np.array([group for entries in groups for group, _weight in entries], np.int32),
        np.array([weight for entries in groups for _group, weight in entries], np.float32),
    )
    deform = np.ones(len(NAMES), bool)
    envelopes = replace(Bones.none().envelopes, multiply=~deform)
    bones = replace(Bones.none(), names=NAMES, deform=deform, envelopes=envelopes)
    entries = entries_of_bones(weights, bones.of_groups(list(group_names)))
    weighting = Weighting(bones, entries, use_envelopes=False)
    found = check_weights(weighting, np.zeros((len(groups), 3)), weights, group_names)
    return {finding.name: finding for finding in found}


def test_planted_faults_are_found_and_nothing_else():
    sound = [[(0, 0.5), (1, 0.5)] for _ in range(50)]
    assert findings_of(sound) == {}
    groups, names = [list(entries) for entries in sound], (*NAMES, "Mask", "left over")
    groups[3] = []
    groups[5] = [(1, 0.0)]
    groups[7] = [(6, 1.0)]
    groups[11] = [(0, 0.00004), (1, 0.00005)]
    groups[13] = [(2, 0.005), (3, 0.002)]
    groups[16] = [(bone, 0.25) for bone in range(4)]
    groups[17] = [(bone, 0.2) for bone in range(5)]
    groups[19] += [(7, 0.3)]
    groups[23] += [(7, 0.0)]
    found = findings_of(groups, names)
    assert {name: finding.vertices.tolist() for name, finding in found.items()} == {
        "no_weights": [3, 5, 7],
        "small_sums": [11, 13],
        "many_influences": [17],
        "boneless_groups": [7, 19],
    }
    assert found["boneless_groups"].groups == ("Mask", "left over")
    assert {finding.name: finding.count for finding in found.values()} == {
        "no_weights": 3,
        "small_sums": 2,
        "many_influences": 1,
        "boneless_groups": 2,
    }
    for finding in found.values():
        assert finding.meaning.endswith(".")
        assert finding.advice.endswith(".")


def pose_check(motions_of_frames, influences):
    check = PoseCheck(influences)
    for frame, motions in enumerate(motions_of_frames, start=1):
        check.add_pose(rotations_of(np.asarray(motions)[:, :3, :3]), frame)
    return {finding.name: finding for finding in check.findings()}


@pytest.mark.parametrize("seed", range(6))
def test_dependence_on_the_order_of_groups_is_found(seed):
    """All orders of each vertex's influences, with the float64 reference."""
    rig = random_rig(seed, vertices=60, bones=8, most_influences=5)
    influences = Influences(rig.offsets, rig.bones, rig.weights)
    found = pose_check([rig.transforms], influences).get("order_of_groups")
    found = set() if found is None else set(found.vertices.tolist())
    expected, unsure = set(), set()
    pose = reference.pose_of(rig.transforms.astype(np.float64), rig.rest_bones.astype(np.float64))
    for vertex in range(len(rig.rest_points)):
        span = slice(rig.offsets[vertex], rig.offsets[vertex + 1])
        bones, weights = rig.bones[span], rig.weights[span].astype(np.float64)
        points, margins = [], []
        for order in map(list, permutations(range(len(bones)))):
            share = weights[order] / weights.sum()
            point, margin = reference.deformed("dq", rig.rest_points[vertex], bones[order], share, pose, None)
            points.append(point)
            margins.append(margin)
        if min(margins) < 1e-4:
            unsure.add(vertex)
        elif np.ptp(points, axis=0).max() > 1e-5:
            expected.add(vertex)
    assert found - unsure == expected
    assert 5 < len(expected) < 55
    assert len(unsure) < 5


def two_bones(weights):
    """Vertices between two bones, with these weights of the second one."""
    weights = np.asarray(weights, np.float32)
    offsets = 2 * np.arange(len(weights) + 1, dtype=np.int32)
    bones = np.tile(np.array([0, 1], np.int32), len(weights))
    return Influences(offsets, bones, np.stack([1 - weights, weights], axis=1).ravel())


def rotated(degrees):
    return [np.eye(4), about([1, 2, 3], degrees)]


def test_half_turns_are_found_when_they_are_near():
    # A vertex with almost all weight on one bone does not move far when the other bone changes hemisphere.
    influences = two_bones([0.5, 0.9, 0.01, 0.3])
    for degrees, near in ((174, False), (176, True), (180, True), (184, True), (186, False)):
        found = pose_check([rotated(degrees)], influences)
        assert ("near_half_turn" in found) == near, degrees
        if near:
            assert found["near_half_turn"].vertices.tolist() == [0, 1, 3]
            assert found["near_half_turn"].frames == (1,)
        assert "order_of_groups" not in found


def test_jumps_are_found_between_frames():
    influences = two_bones([0.5, 0.02, 0.4])
    found = pose_check([rotated(d) for d in (0, 90, 150, 210, 250)], influences)
    assert set(found) == {"jumps"}
    assert found["jumps"].vertices.tolist() == [0, 2]
    assert found["jumps"].frames == (4,)
    assert pose_check([rotated(d) for d in (0, 60, 120, 170, 120)], influences) == {}


def test_vertices_without_influences_are_left_alone():
    influences = Influences(np.zeros(4, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32))
    assert pose_check([rotated(0), rotated(180)], influences) == {}
