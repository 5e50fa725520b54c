# SPDX-License-Identifier: GPL-3.0-or-later
"""Random poses that a rig can take: joints rotate within their limits, or slightly more than in given
poses."""

from dataclasses import dataclass

import numpy as np
import sinew

# A joint's range in given poses is extended on both sides by this share, and by this angle.
_MORE, _AT_LEAST = 0.25, np.radians(10.0)
# Methods that blend rotations are not defined at 180 degrees.
_MOST = np.radians(170.0)


@dataclass(frozen=True)
class Joints:
    """The joints of a rig.

    rest     float [bones, 4, 4], armature space; bones come after their parents
    parents  int [bones]; -1 for none
    limits   float [bones, 3, 2]: smallest and largest rotation about each of a bone's axes, in radians; nan
             for no limit
    """

    rest: np.ndarray
    parents: np.ndarray
    limits: np.ndarray


def sampled(poses: np.ndarray, joints: Joints, count: int, seed: int) -> np.ndarray:
    """Returns float64 [count, bones, 4, 4], armature space: `poses` in turns, in which every bone gets a
    random rotation relative to its parent. Bones without a parent, all distances and all scale are unchanged.

    poses  float [frames, bones, 4, 4], armature space; joints without limits take their range from these

    Rotation vectors (axis times angle) are sampled from a box: that of the limits, or the extended box of the
    poses and rest.
    """
    rng = np.random.default_rng(seed)
    relative = _relative(poses, joints)
    split = sinew.affine.split_scale(relative, np.identity(4))
    # The shorter rotations, as axis times angle.
    vectors = np.asarray(sinew.affine.to_twist(split.rigid))[..., :3]
    least, most = _range(vectors, joints.limits)
    chosen = np.arange(count) % len(poses)
    rotations = _matrices(rng.uniform(least, most, (count, *least.shape)))
    moved = np.array(split.rigid)[chosen]
    is_jointed = joints.parents >= 0
    moved[:, is_jointed, :3, :3] = rotations[:, is_jointed]
    moved = moved @ split.scale[chosen]
    result = np.empty_like(moved)
    for bone, parent in enumerate(joints.parents):
        if parent < 0:
            result[:, bone] = poses[chosen, bone]
        else:
            at_rest = np.linalg.inv(joints.rest[parent].astype(np.float64)) @ joints.rest[bone]
            result[:, bone] = result[:, parent] @ at_rest @ moved[:, bone]
    return result


def _relative(poses: np.ndarray, joints: Joints) -> np.ndarray:
    """float64 [frames, bones, 4, 4]: each bone's motion relative to its parent's."""
    result = np.tile(np.identity(4), (*poses.shape[:2], 1, 1))
    for bone, parent in enumerate(joints.parents):
        if parent >= 0:
            at_rest = np.linalg.inv(joints.rest[parent].astype(np.float64)) @ joints.rest[bone]
            # A parent can be scaled to zero.
            result[:, bone] = np.linalg.pinv(poses[:, parent] @ at_rest) @ poses[:, bone]
    return result


def _range(vectors: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """float64 [bones, 3], twice: the smallest and the largest rotation vectors."""
    least, most = np.minimum(vectors.min(axis=0), 0.0), np.maximum(vectors.max(axis=0), 0.0)
    more = _MORE * (most - least) + _AT_LEAST
    has_limits = np.isfinite(limits).all(axis=2)
    least = np.where(has_limits, limits[:, :, 0], least - more)
    most = np.where(has_limits, limits[:, :, 1], most + more)
    return np.clip(least, -_MOST, _MOST), np.clip(most, -_MOST, _MOST)


def _matrices(vectors: np.ndarray) -> np.ndarray:
    """float64 [.., 3, 3]; vectors longer than _MOST are shortened to it."""
    angles = np.minimum(np.linalg.norm(vectors, axis=-1), _MOST)
    return np.asarray(sinew.affine.from_axis_angle(vectors, angles))[..., :3, :3]
