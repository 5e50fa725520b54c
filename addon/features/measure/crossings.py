# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of a shape that cross others."""

from collections.abc import Sequence

import numpy as np
import sinew

from .metrics import Shape

# A shape takes as long as its other measures together, so it is counted only at this many frames, evenly
# distributed.
MOST_FRAMES = 8


def crossing_triangles(
    points: np.ndarray, triangles: np.ndarray, groups: np.ndarray | None = None
) -> set[tuple[int, int]]:
    """Returns pairs of triangles that cross and share no vertex, the lower index first.

    points     [vertices, 3]
    triangles  int [triangles, 3]
    groups     int32 [triangles]: two of one group do not count; below 0: of none
    """
    return set(map(tuple, sinew.crossing_triangles(points, triangles, groups).tolist()))


def crossings(shape: Shape, groups: np.ndarray | None = None) -> set[tuple[int, int]]:
    """groups: as of crossing_triangles()"""
    return crossing_triangles(shape.points.T, shape.surface.triangles, groups)


def frames_to_count(frames: Sequence[float]) -> set[float]:
    """Returns those of the frames at which crossings are counted."""
    places = np.linspace(0, len(frames) - 1, min(len(frames), MOST_FRAMES)).round().astype(int)
    return {frames[place] for place in places}
