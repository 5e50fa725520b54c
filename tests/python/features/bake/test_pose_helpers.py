# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects helper bones that follow the pose, in poses other than those they were made from; and the
random poses."""

from __future__ import annotations

import numpy as np
import pytest
import sinew
from rigs import LINEAR, about
from scipy.spatial.transform import Rotation
from sinew_addon.features.bake import pose_helpers, pose_samples
from sinew_addon.features.bake.helper_bones import Motion, Wanted
from sinew_addon.features.bake.pose_samples import Joints
from test_helper_bones import INFLUENCES, POSES, SEGMENTS, TUBE, errors_of, motion_by, played, result_of

# Bones are along z, with Y along each bone.
REST = np.tile(np.identity(4), (2, 1, 1))
REST[:, :3, :3] = about((1, 0, 0), 90.0)[:3, :3]
REST[1, 2, 3] = 2.0
# Rotations of a joint between two bones, in degrees about x, y, z.
REACH = (130.0, 60.0, 165.0)


def random_motion(method, count, seed, size=1.0):
    """size  of the second bone"""
    deformer = sinew.Deformer(*TUBE.mesh, method, vertex_data=TUBE.vertex_data(method))
    bones = []
    for vector in np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3)) * REACH:
        posed = TUBE.bones(tuple(vector), np.linalg.norm(vector))
        joint = REST[1].copy()
        scale = joint @ np.diag([1.0, size, 1.0, 1.0]) @ np.linalg.inv(joint)
        bones.append(posed @ np.stack([np.identity(4), scale]))
    inverses = np.linalg.inv(REST)
    points = [deformer.deform((b @ REST).astype(np.float32), rest_inverses=inverses) for b in bones]
    rest = TUBE.points.astype(np.float32)[None]
    moved = np.array(bones)[:, :, :3]
    return Motion(rest, np.array(points, dtype=np.float32), moved, INFLUENCES, SEGMENTS)


def solved(motion, wanted):
    return result_of(pose_helpers.solve(motion, wanted, REST))


# The share of linear blending's error that remains, bent and twisted in ways that they were not made for.
@pytest.mark.parametrize(
    ("method", "count", "share"),
    [("dq", 2, 0.16), ("dq", 4, 0.06), ("sbs", 4, 0.06), ("cor", 2, 0.16), ("cor", 4, 0.06)],
)
def test_bend_and_twist_that_they_were_not_made_from(method, count, share):
    solution = solved(random_motion(method, 48, seed=3), Wanted(count))
    motion = motion_by(method)
    before, after, errors, errors_before = pose_helpers.errors_of(solution, motion, REST)
    linear = np.array([TUBE.deformed("lbs", *pose)[0] for pose in POSES])
    assert np.allclose((before.rms, before.worst), errors_of(linear, motion.targets), rtol=1e-3)
    assert after.rms < share * before.rms
    assert np.isclose(np.sqrt(np.square(errors).mean()), after.rms, rtol=1e-4)
    assert np.isclose(np.sqrt(np.square(errors_before).mean()), before.rms, rtol=1e-4)


@pytest.mark.parametrize("size", [1.0, 1.4])
@pytest.mark.parametrize(("method", "head_method"), [("dq", "dq"), ("cor", "lbs")])
def test_a_helper_bone_moves_as_the_method_blends(method, head_method, size):
    """The helper bone's head, as the library deforms a point with the same influences. Centres of
    rotation are moved linearly."""
    motion = random_motion(method, 24, seed=4, size=size)
    solution = solved(motion, Wanted(3))
    assert len(solution.blends) == len(solution.parents) == 3
    assert {blend.is_centre for blend in solution.blends} == {head_method == "lbs"}
    for blend, moved in zip(solution.blends, solution.motions.swapaxes(0, 1), strict=True):
        assert np.isclose(blend.weights.sum(), 1.0)
        assert (blend.weights >= 0.0).all()
        # The helper bone's head: scale applies about the point itself there, as in the constraint.
        point = blend.head.astype(np.float32)[None]
        bones, weights = blend.bones.astype(np.int32), blend.weights.astype(np.float32)
        offsets = np.array([0, len(bones)], np.int32)
        deformer = sinew.Deformer(point, offsets, bones, weights, head_method, REST, LINEAR)
        for own, matrix in zip(motion.bones, moved, strict=True):
            posed = np.concatenate([own, np.tile([[[0.0, 0.0, 0.0, 1.0]]], (2, 1, 1))], axis=1) @ REST
            expected = deformer.deform(posed.astype(np.float32), rest_inverses=np.linalg.inv(REST))[0]
            assert np.allclose(matrix[:, :3] @ blend.head + matrix[:, 3], expected, atol=2e-5)


def test_the_stated_error_is_what_is_played():
    motion = random_motion("dq", 24, seed=5)
    solution = solved(motion, Wanted(2))
    found = errors_of(played(motion, solution), motion.targets)
    assert np.allclose((solution.after.rms, solution.after.worst), found, rtol=1e-3)
    again = pose_helpers.errors_of(solution, motion, REST)
    assert np.allclose((again[1].rms, again[1].worst), found, rtol=1e-3)


def relative(poses, joints):
    """Each jointed bone's motion relative to its parent, independently of the code."""
    found = {}
    for bone, parent in enumerate(joints.parents):
        if parent >= 0:
            at_rest = np.linalg.inv(joints.rest[parent]) @ joints.rest[bone]
            found[bone] = np.linalg.inv(poses[:, parent] @ at_rest) @ poses[:, bone]
    return found


def test_random_poses_keep_to_limits_and_joints():
    limits = np.full((3, 3, 2), np.nan)
    limits[1] = [(-1.0, 0.2), (0.0, 0.0), (-0.1, 0.1)]
    rest = np.concatenate([REST, REST[1:]])
    rest[2, 2, 3] = 3.0
    joints = Joints(rest, np.array([-1, 0, 1]), limits)
    # The last bone rotates by 0 to 0.8 about its x, and is 0.5 away from its parent.
    poses = np.tile(rest, (3, 1, 1, 1))
    poses[:, 0] = np.array([about((0, 0, 1), a) for a in (0.0, 10.0, 20.0)]) @ rest[0]
    for frame, angle in enumerate((0.0, 0.4, 0.8)):
        poses[frame, 1] = poses[frame, 0] @ np.linalg.inv(rest[0]) @ rest[1]
        moved = about((1, 0, 0), np.degrees(angle))
        moved[:3, 3] = (0.0, 0.0, 0.5)
        poses[frame, 2] = poses[frame, 1] @ np.linalg.inv(rest[1]) @ rest[2] @ moved
    sampled = pose_samples.sampled(poses, joints, 200, seed=6)
    # A bone without a parent is not changed.
    assert np.array_equal(sampled[:, 0], poses[np.arange(200) % 3, 0])
    moved = relative(sampled, joints)
    limited, free = (Rotation.from_matrix(moved[bone][:, :3, :3]).as_rotvec() for bone in (1, 2))
    assert (limited >= limits[1, :, 0] - 1e-5).all()
    assert (limited <= limits[1, :, 1] + 1e-5).all()
    assert np.ptp(limited[:, 0]) > 1.1
    more = 0.25 * 0.8 + np.radians(10.0)
    assert (free.min(axis=0) >= -np.array([more, np.radians(10), np.radians(10)]) - 1e-5).all()
    assert (free.max(axis=0) <= np.array([0.8 + more, np.radians(10), np.radians(10)]) + 1e-5).all()
    assert free[:, 0].max() > 0.9
    assert np.allclose(moved[1][:, :3, 3], 0.0, atol=1e-9)
    assert np.allclose(moved[2][:, :3, 3], (0.0, 0.0, 0.5), atol=1e-9)
    assert not np.array_equal(sampled, pose_samples.sampled(poses, joints, 200, seed=7))
