# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage `delta_mush` in float64 numpy: Blender's Corrective Smooth (Mancewicz, Derksen, Rijpkema, Wilson
2014), one vertex or corner at a time, as the golden set defines it, for any mesh and options."""

import numpy as np
from reference import stages


def corners_of(faces):
    """(vertex, previous vertex, next vertex) for each corner of `faces`, lists of vertices."""
    return [(f[i], f[i - 1], f[(i + 1) % len(f)]) for f in faces for i in range(len(f))]


def boundary_of(faces, edges):
    """The vertices at the ends of edges that have a single face."""
    count = {frozenset(map(int, edge)): 0 for edge in edges}
    for vertex, _, following in corners_of(faces):
        count[frozenset((vertex, following))] += 1
    return sorted({v for edge, number in count.items() if number == 1 for v in edge})


def amount(rest, edges, factor, radius, smooth_type):
    """The number of iterations, and the factor of each vertex, that spread a detail to the width
    `radius`: n iterations with the factor f spread it by h sqrt(n f / 2), with h the root mean square of
    a vertex's edges; half of that squared if neighbours are weighted by length."""
    a, b = np.asarray(edges).reshape(-1, 2).T
    squares = ((rest[a] - rest[b]) ** 2).sum(axis=1)
    total = np.bincount(np.r_[a, b], np.r_[squares, squares], minlength=len(rest))
    squared = total / np.maximum(np.bincount(np.r_[a, b], minlength=len(rest)), 1)
    factors = np.full(len(rest), float(factor))
    found = np.sort(squared[squared > 0.0])
    if not len(found) or factor == 0.0:
        return 0, factors
    wanted = (4.0 if smooth_type == "length_weighted" else 2.0) * radius**2
    # All except the shortest tenth.
    iterations = int(np.clip(np.ceil(wanted / (factor * found[int(0.1 * len(found))])), 1, 1000))
    some = squared > 0.0
    factors[some] = np.minimum(wanted / (iterations * squared[some]), factor)
    return iterations, factors


def unit(vector):
    length = np.linalg.norm(vector)
    return vector / length if length > np.sqrt(1e-35) else np.zeros(3)


def frame(before, at, after, precision=np.float64):
    """The axes of a corner, as columns, and its weight. precision: of the directions of its edges. At the tip
    of a needle they are nearly opposite, and the axes come from their difference."""
    a, b = (unit(edge).astype(precision).astype(np.float64) for edge in (before - at, at - after))
    if (np.abs(a - b) <= stages.EPSILON).all():
        return np.eye(3), 0.0
    z, x = unit(np.cross(a, b)), unit(a + b)
    return np.column_stack([x, np.cross(z, x), z]), stages.angle(a @ b)


def delta_mush(  # noqa: PLR0913 - as the library's
    points,
    mesh,
    *,
    iterations=5,
    radius=0.0,
    factor=0.5,
    smooth_type="simple",
    pin_boundary=False,
    weights=None,
    scale=1.0,
    rounding=0.0,
):
    """mesh: (rest points, faces as lists of vertices, edges). rounding: added to smoothed points, to see
    its effect; the directions of edges are then rounded to float32, too."""
    rest, faces, edges = mesh
    rest, points = np.asarray(rest, np.float64), np.asarray(points, np.float64)
    edges = np.asarray(edges).reshape(-1, 2)
    factors = np.full(len(rest), float(factor))
    if radius > 0.0:
        iterations, factors = amount(rest, edges, factor, radius, smooth_type)
    if weights is not None:
        factors = factors * np.clip(np.asarray(weights, np.float64), 0.0, 1.0)
    if pin_boundary:
        factors[boundary_of(faces, edges)] = 0.0
    rest_smoothed = stages.smoothed(rest, edges, factors, iterations, smooth_type) - rounding
    result = stages.smoothed(points, edges, factors, iterations, smooth_type) + rounding
    details, weight_sums = np.zeros_like(result), np.zeros(len(result))
    precision = np.float32 if np.any(rounding) else np.float64
    for at, before, after in corners_of(faces):
        axes, _ = frame(*rest_smoothed[[before, at, after]], precision)
        posed_axes, weight = frame(*result[[before, at, after]], precision)
        details[at] += weight * posed_axes @ axes.T @ (rest[at] - rest_smoothed[at])
        weight_sums[at] += weight
    has_details = weight_sums > 0
    result[has_details] += scale * details[has_details] / weight_sums[has_details, None]
    return result
