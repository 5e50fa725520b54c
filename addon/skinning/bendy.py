# SPDX-License-Identifier: GPL-3.0-or-later
"""Bendy bones: n segments have n + 1 joints along the bone; a vertex is moved by the two joints nearest to
it.

A joint is what Blender calls so (PoseBone.bbone_segment_matrix): the transform between two segments.

Based on what Blender's Armature modifier does. For the curved mapping, on the description of its "B-Bone
vertex mapping" in Blender's developer documentation and its change 110758, whose constants are used here.
"""

from __future__ import annotations

import numpy as np

from .bones import RestBones
from .influences import Influences, offsets_of, owners_of

# The curved mapping's smoothing: its width at the middle plane, how fast the correction towards the ideal
# slope grows, and how sharply it ends.
WIDTH, SLOPE, SHARPNESS = 0.222, 3.0, 7.0
# Of an interval, until it is as short as float32 tells.
_HALVINGS = 30
# A share that counts as none; and how far beyond it float32 tells none, too, of the bone's length.
_NOTHING, _BEYOND = 1e-7, 0.02


def spread_over_joints(influences: Influences, points: np.ndarray, rig: RestBones) -> Influences:
    """Returns the influences, with each influence of a bendy bone split between the two joints nearest to the
    vertex: along the bone's curve at rest, or along its straight line.

    points  float [vertices, 3], rest points in armature space
    """
    rest, segments, first_joints = rig.rest, rig.segments, rig.first_joints
    counts = influences.counts
    vertices = owners_of(counts)
    bones = influences.bones
    bends = segments[bones] > 1
    bent = bones[bends]
    positions = points[vertices[bends]].astype(np.float64)
    share = np.empty(len(bent))
    for bone in np.unique(bent):
        of_bone = bent == bone
        if rig.curved[bone]:
            joints = rest[first_joints[bone] :][: segments[bone] + 1].astype(np.float64)
            share[of_bone] = share_along_curve(positions[of_bone], joints)
        else:
            bone_from_armature = np.linalg.inv(rest[bone].astype(np.float64))
            distances = positions[of_bone] @ bone_from_armature[1, :3] + bone_from_armature[1, 3]
            share[of_bone] = distances / rig.lengths[bone]
    along = np.clip(share, 0.0, 1.0) * segments[bent]
    joint = np.clip(np.floor(along).astype(np.int64), 0, segments[bent] - 1)
    second_share = np.clip(along - joint, 0.0, 1.0)

    # Two entries for every influence; the second has weight 0 for bones that do not bend, and is then
    # dropped. The order of the influences is kept: dual quaternions depend on it.
    targets = np.stack([bones, bones], axis=1)
    weights = np.stack([influences.weights, np.zeros_like(influences.weights)], axis=1)
    targets[bends, 0] = first_joints[bent] + joint
    targets[bends, 1] = first_joints[bent] + joint + 1
    weights[bends, 0] = influences.weights[bends] * (1.0 - second_share)
    weights[bends, 1] = influences.weights[bends] * second_share
    kept = weights.ravel() > 0.0
    offsets = offsets_of(np.bincount(np.repeat(vertices, 2)[kept], minlength=len(counts)))
    return Influences(
        offsets, targets.ravel()[kept].astype(np.int32), weights.ravel()[kept].astype(np.float32)
    )


def points_of_joints(joints: np.ndarray, rest: np.ndarray, length: float, is_curved: bool) -> np.ndarray:
    """Returns float64 [segments + 1, 3]: for each joint of a bendy bone a point of the same space that is
    mapped to this joint alone.

    joints, rest  float [segments + 1, 4, 4] and [4, 4], the joints and the bone at rest, Y along it
    is_curved     vertices are mapped along the curve at rest, not along the straight line
    """
    segments = len(joints) - 1
    numbers = np.arange(segments + 1) / segments
    if not is_curved:
        return rest[:3, 3] + numbers[:, None] * (length * rest[:3, 1].astype(np.float64))
    joints = joints.astype(np.float64)
    centres = joints[:, :3, 3]
    size = np.linalg.norm(np.diff(centres, axis=0), axis=1).sum()
    ends = joints[[0, -1], :3, 1] / np.linalg.norm(joints[[0, -1], :3, 1], axis=1, keepdims=True)
    # Beyond its ends, as near as smoothing moves nothing, and between joints on the curve.
    line = np.vstack([centres[0] - size * ends[0], centres, centres[-1] + size * ends[1]])
    positions = np.array([-1.0, *numbers, 2.0])

    def on_line(at: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(at, positions, axis) for axis in line.T], axis=1)

    low, high = np.append(-1.0, numbers[:-1]), np.append(numbers[1:], 2.0)
    wanted = np.clip(numbers, _NOTHING, 1.0 - _NOTHING)
    for _step in range(_HALVINGS):
        middle = 0.5 * (low + high)
        is_before = share_along_curve(on_line(middle), joints) < wanted
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    found = np.append(low[0] - _BEYOND, high[1:])
    found[-1] += _BEYOND
    return on_line(np.clip(found, -1.0, 2.0))


def share_along_curve(points: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """Returns float64 [n]: the position of each point along a bendy bone's curve, 0 at its head, 1 at its
    tail.

    A binary search among the planes through the joints finds the segment. Inside a bend the position would
    jump at these planes, so it is smoothed at each plane that the search tested, from the last to the first.

    points  float64 [n, 3]
    joints  float64 [segments + 1, 4, 4] at rest, Y along the curve, same space
    """
    segments = len(joints) - 1
    normals = joints[:, :3, 1] / np.linalg.norm(joints[:, :3, 1], axis=1, keepdims=True)
    centres = joints[:, :3, 3]
    distances = points @ normals.T - np.einsum("ij,ij->i", normals, centres)
    arc_length = np.linalg.norm(np.diff(centres, axis=0), axis=1).sum()

    tested, first, last = _search(distances, segments)
    nearer, farther = (
        np.abs(np.take_along_axis(distances, np.clip(plane, 0, segments)[:, None], axis=1)[:, 0])
        for plane in (first, last)
    )
    between = np.divide(nearer, nearer + farther, out=np.zeros_like(nearer), where=nearer + farther > 0.0)
    share = np.where(last <= 0, 0.0, np.where(first >= segments, 1.0, (first + between) / segments))

    straightness = np.linalg.norm(centres[-1] - centres[0]) / arc_length
    scales = _smoothing_scales(segments, segments * straightness * WIDTH)
    for plane, scale in reversed(list(zip(tested, scales, strict=False))):
        share = _pull_to_plane(share, plane, distances / arc_length, segments, scale)
    return share


def _search(distances: np.ndarray, segments: int) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Returns the planes tested at each step, -1 for points whose search has ended, and the two planes that
    enclose each point: -1 before the first plane, segments + 1 behind the last."""
    count = len(distances)
    first, last = np.full(count, -1), np.full(count, segments + 1)
    bias = np.zeros(count, dtype=np.int64)
    tested = []
    while (searching := last - first > 1).any():
        plane = np.where(searching, (first + last + bias) // 2, -1)
        before = distances[np.arange(count), plane] < 0.0
        last = np.where(searching & before, plane, last)
        first = np.where(searching & ~before, plane, first)
        # Odd numbers are rounded towards the last split, for symmetry.
        bias = before.astype(np.int64)
        tested.append(plane)
    return tested, first, last


def _smoothing_scales(segments: int, widest: float) -> np.ndarray:
    """Returns 1 / width of the smoothing at each step of the search, in lengths of the whole bone."""
    steps = int(np.ceil(np.log2(segments + 2)))
    narrowing = max(widest, 1.0) ** (1.0 / (steps - 1))
    return segments / widest * narrowing ** np.arange(steps)


def _pull_to_plane(
    share: np.ndarray, plane: np.ndarray, distances: np.ndarray, segments: int, scale: float
) -> np.ndarray:
    """Returns `share`, where values of points near a plane are moved towards those with the ideal slope."""
    distance = distances[np.arange(len(share)), plane]
    at_plane = plane / segments
    gap = np.abs(share - at_plane) - np.abs(distance)
    nearness = 1.0 - np.abs(distance) * scale
    pulled = (plane >= 0) & (gap > 0.0) & (nearness > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = SLOPE * gap / (SLOPE * gap + np.abs(distance))
        strength = nearness**2 * (SHARPNESS + 1.0) / (SHARPNESS * nearness + 1.0)
    return np.where(pulled, share + slope * strength * (at_plane + distance - share), share)
