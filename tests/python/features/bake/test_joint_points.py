# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what plain bones in place of bendy ones rest on: points of joints, exact weights that stay, and
the heaviest influences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs import about
from sinew_addon.features.bake.helper_bones import Motion, Wanted
from sinew_addon.skinning.bendy import points_of_joints, spread_over_joints
from sinew_addon.skinning.influences import Influences
from sinew_addon.skinning.rig import Bones
from test_helper_bones import solved


def curve(segments, bend):
    """Joints [segments + 1, 4, 4] along an arc that starts along Y and bends by so many radians."""
    joints = []
    for angle in np.linspace(0.0, bend, segments + 1):
        joint = np.identity(4)
        joint[:3, :3] = about((0.0, 0.0, 1.0), np.degrees(angle))[:3, :3]
        radius = 2.0 / bend
        joint[:3, 3] = radius * np.array([np.cos(angle) - 1.0, np.sin(angle), 0.0])
        joints.append(joint)
    return np.array(joints)


@pytest.mark.parametrize("is_curved", [False, True])
@pytest.mark.parametrize("segments", [2, 5, 32])
def test_each_point_is_mapped_to_its_joint_alone(is_curved, segments):
    joints, rest = curve(segments, 1.4), np.identity(4)
    points = points_of_joints(joints, rest, 2.0, is_curved)
    one_each = Influences(
        np.arange(segments + 2, dtype=np.int32),
        np.zeros(segments + 1, dtype=np.int32),
        np.ones(segments + 1, dtype=np.float32),
    )
    bone = replace(
        Bones.none(),
        rest=np.concatenate([rest[None], joints]),
        lengths=np.array([2.0]),
        segments=np.array([segments]),
        first_joints=np.array([1]),
        curved=np.array([is_curved]),
    )
    spread = spread_over_joints(one_each, points, bone)
    bones, weights = spread.padded()
    assert np.array_equal(bones[:, 0], 1 + np.arange(segments + 1))
    assert (weights[:, 0] > 1.0 - 1e-5).all()


def some_influences():
    """Of four vertices; the second has none, the third three equal ones."""
    counts = [2, 0, 3, 4]
    bones = [0, 1, 2, 0, 1, 3, 1, 0, 2]
    weights = [0.75, 0.25, 0.2, 0.2, 0.2, 5e-5, 0.5, 0.3, 0.1]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return Influences(*(np.array(a, t) for a, t in ((offsets, "i4"), (bones, "i4"), (weights, "f4"))))


def test_the_heaviest_are_kept_and_of_equal_ones_the_first():
    cut = some_influences().heaviest(2)
    assert cut.counts.tolist() == [2, 0, 2, 2]
    assert cut.bones.tolist() == [0, 1, 2, 0, 1, 0]
    assert np.allclose(cut.weights, [0.75, 0.25, 0.2, 0.2, 0.5, 0.3])


def motion_of(influences, frames=5):
    random = np.random.default_rng(1)
    motions = np.zeros((frames, 4, 4, 4))
    for frame in range(frames):
        for bone in range(4):
            motions[frame, bone] = np.identity(4)
            motions[frame, bone, :3, :3] += 0.3 * random.normal(size=(3, 3))
            motions[frame, bone, :3, 3] = random.normal(size=3)
    rest = random.normal(size=(4, 3)).astype(np.float32)
    shapes = []
    for frame in motions:
        points = rest.astype(np.float64)
        for vertex in range(4):
            own = range(influences.offsets[vertex], influences.offsets[vertex + 1])
            total = sum(float(influences.weights[k]) for k in own)
            if total:
                position = np.append(rest[vertex], 1.0)
                moved = [influences.weights[k] / total * (frame[influences.bones[k]] @ position) for k in own]
                points[vertex] = sum(moved)[:3]
        shapes.append(points)
    return rest, motions, np.array(shapes)


def test_linear_blending():
    influences = some_influences()
    rest, motions, shapes = motion_of(influences)
    for frame, expected in zip(motions, shapes, strict=True):
        assert np.abs(influences.blended(frame, rest) - expected).max() < 1e-12


def test_exact_weights_stay_to_the_last_digit_and_need_no_helpers():
    """Also the smallest; only those of a vertex with too many are solved again."""
    influences = some_influences()
    rest, motions, shapes = motion_of(influences)
    motion = Motion(rest[None], shapes.astype(np.float32), motions[:, :, :3], influences, np.zeros((4, 2, 3)))
    bones, weights = influences.padded()
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-30)
    solution = solved(motion, Wanted(4, influences=4))
    assert len(solution.parents) == 0
    for vertex in range(4):
        found = dict(zip(solution.bones[vertex], solution.weights[vertex], strict=True))
        expected = dict(zip(bones[vertex], weights[vertex], strict=True))
        assert {b: w for b, w in found.items() if b >= 0} == {b: w for b, w in expected.items() if b >= 0}
