# SPDX-License-Identifier: GPL-3.0-or-later
"""Corrective shapes: offsets of rest points with which skinning gives another shape in one pose."""

from collections.abc import Callable

import numpy as np

# One step would do, as skinning is affine in each rest point; but with envelopes, weights depend on the
# points.
STEPS = 4
# As a share of the mesh's diagonal: how far rest points are moved to find the effect, and when a result is
# close enough.
PROBE, NEAR = 1e-2, 1e-6
# Where skinning flattens the surroundings of a point to less than this share, the needed offset would be too
# large.
LEAST_WIDTH = 0.05


def offsets(
    rest_points: np.ndarray, wanted: np.ndarray, skin: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the offsets of rest points, float64 [vertices, 3], and the distance of each vertex from
    `wanted` without and with them, [vertices]. Vertices that cannot be moved there have no offset.

    rest_points  float32 [vertices, 3]
    wanted       float32 [vertices, 3], the shape
    skin         computes the shape of rest points, both [vertices, 3]; each vertex depends on its own point
                 alone
    """
    rest, goal = rest_points.astype(np.float64), wanted.astype(np.float64)
    found = np.zeros_like(rest)
    if not len(rest):
        return found, np.zeros(0), np.zeros(0)

    def shape(moved: np.ndarray) -> np.ndarray:
        return skin((rest + moved).astype(np.float32)).astype(np.float64)

    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0))) or 1.0
    now = shape(found)
    start = left = _distances(goal, now)
    for _step in range(STEPS):
        if left.max() <= NEAR * diagonal:
            break
        axes = [
            (shape(found + PROBE * diagonal * axis) - now) / (PROBE * diagonal) for axis in np.identity(3)
        ]
        found += _solve(np.stack(axes, axis=-1), goal - now)
        now = shape(found)
        left = _distances(goal, now)
    # Drops offsets that did not bring a vertex nearer.
    found[left > start] = 0.0
    return found, start, np.minimum(left, start)


def _distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a - b, axis=1)


def _solve(matrices: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solves for [n, 3]; zero where a matrix of [n, 3, 3] is flatter than LEAST_WIDTH."""
    left, widths, right = np.linalg.svd(matrices)
    reached = widths[:, -1] >= LEAST_WIDTH
    inverse = np.divide(1.0, widths, out=np.zeros_like(widths), where=reached[:, None])
    turned = np.einsum("nji,nj->ni", left, sides) * inverse
    return np.einsum("nji,nj->ni", right, turned)
