# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds where a surface intersects itself, with Blender's BVH tree."""

from __future__ import annotations

import numpy as np
from mathutils.bvhtree import BVHTree


def crossing_triangles(points: np.ndarray, triangles: np.ndarray) -> set[tuple[int, int]]:
    """Returns pairs of triangles that cross and share no vertex, the lower index first.

    points     [vertices, 3]
    triangles  int [triangles, 3]
    """
    tree = BVHTree.FromPolygons(points.tolist(), triangles.tolist(), all_triangles=True)
    pairs = np.array(tree.overlap(tree), dtype=np.int64).reshape(-1, 2)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    first, second = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    apart = ~(first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    return set(map(tuple, pairs[apart].tolist()))
