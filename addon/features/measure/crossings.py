# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of a shape that cross others."""

from collections.abc import Sequence

import numpy as np
from mathutils.bvhtree import BVHTree

from .metrics import Shape

# Counting takes longer than all other measures together, so it is done only at this many frames, evenly
# distributed.
MOST_FRAMES = 8


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


def crossings(shape: Shape) -> set[tuple[int, int]]:
    return crossing_triangles(shape.points.T, shape.surface.triangles)


def frames_to_count(frames: Sequence[float]) -> set[float]:
    """Returns those of the frames at which crossings are counted."""
    places = np.linspace(0, len(frames) - 1, min(len(frames), MOST_FRAMES)).round().astype(int)
    return {frames[place] for place in places}
