# SPDX-License-Identifier: GPL-3.0-or-later
"""Bendy bones: n segments move vertices by n + 1 joints along the bone, each vertex by the two beside it.

Based on: what Blender's Armature modifier does for the straight mapping.
"""

from __future__ import annotations

import numpy as np

from .influences import Influences


def spread_over_joints(
    influences: Influences,
    points: np.ndarray,
    rest: np.ndarray,
    lengths: np.ndarray,
    segments: np.ndarray,
    first_joints: np.ndarray,
) -> Influences:
    """The influences with each one of a bendy bone shared between the two joints beside the vertex.

    points        float [vertices, 3], rest points in armature space
    rest          float [bones, 4, 4], armature space, Y along the bone
    lengths       float [bones]
    segments      int [bones], 1 for a bone that does not bend
    first_joints  int [bones], index of the bone's first joint; its joints follow one another
    """
    counts = influences.counts
    vertices = np.repeat(np.arange(len(counts)), counts)
    bones = influences.bones
    bends = segments[bones] > 1
    bent = bones[bends]
    inverse = np.linalg.inv(rest.astype(np.float64))[bent]
    here = points[vertices[bends]].astype(np.float64)
    along = np.einsum("ij,ij->i", inverse[:, 1, :3], here) + inverse[:, 1, 3]
    position = np.clip(along / lengths[bent], 0.0, 1.0) * segments[bent]
    joint = np.clip(np.floor(position).astype(np.int64), 0, segments[bent] - 1)
    second_share = np.clip(position - joint, 0.0, 1.0)

    # Two entries for every influence, the second of weight 0 for bones that do not bend, then those out.
    # The order stays that of the influences: dual quaternions depend on it.
    slots = np.stack([bones, bones], axis=1)
    weights = np.stack([influences.weights, np.zeros_like(influences.weights)], axis=1)
    slots[bends, 0] = first_joints[bent] + joint
    slots[bends, 1] = first_joints[bent] + joint + 1
    weights[bends, 0] = influences.weights[bends] * (1.0 - second_share)
    weights[bends, 1] = influences.weights[bends] * second_share
    kept = weights.ravel() > 0.0
    offsets = np.zeros(len(counts) + 1, dtype=np.int32)
    np.cumsum(np.bincount(np.repeat(vertices, 2)[kept], minlength=len(counts)), out=offsets[1:])
    return Influences(offsets, slots.ravel()[kept].astype(np.int32), weights.ravel()[kept].astype(np.float32))
