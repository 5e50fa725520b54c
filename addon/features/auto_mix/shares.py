# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of two methods is better at each vertex, smoothed over the surface: the weights of the stage Mix."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from ...skinning.surface import coincident_vertices
from ...skinning.vectors import cross, dots
from ..measure.metrics import Measured

# How much each error counts, squared: a bent joint has to stretch, and the eye sees lost volume first.
STRETCH, BULGE, VOLUME, CROSSING = 0.05, 1.0, 3.0, 0.1
# Errors that differ by this much are half as sure to be followed as those that differ far more.
SURE = 0.03
# Thinner parts count as this thick, as a share of the median: a vertex may lie on its bone's axis.
THINNEST = 0.25
# Points of both methods are alike where their distance is this share of the thickness. There nothing is seen
# of the choice, and the first method, without the second, takes half the time.
ALIKE, TO_FIRST = 0.005, 0.1
# The same where both are equally good.
LEAST = 0.01
# Smaller weights, and as small differences from 1, make no difference that is seen.
SMALLEST = 0.01
TOLERANCE, STEPS_AT_ONCE = 1e-4, 8


class VertexErrors:
    """What two methods do at each vertex, over the frames that are added.

    thickness  float64 [vertices], how far each is from the axis of its bone at rest
    errors     float64 [2, vertices], the worst of each method, squared
    apart      float64 [vertices], the largest distance between the points of both
    """

    def __init__(self, thickness: np.ndarray) -> None:
        usual = float(np.median(thickness[thickness > 0.0])) if (thickness > 0.0).any() else 1.0
        self.thickness = np.maximum(thickness, THINNEST * usual)
        self.errors = np.zeros((2, len(thickness)))
        self.apart = np.zeros(len(thickness))

    def add(
        self, by_methods: tuple[Measured, Measured], crossings: tuple[np.ndarray, np.ndarray] | None
    ) -> None:
        """Adds a frame.

        crossings  int [triangles of each], those that cross others; None where they were not counted
        """
        for number, measured in enumerate(by_methods):
            squared = STRETCH * (measured.field("stretch") - 1.0) ** 2
            squared += BULGE * (measured.bulge / self.thickness) ** 2
            squared += VOLUME * measured.limb_losses**2
            if crossings is not None:
                squared[measured.shape.surface.triangles[crossings[number]]] += CROSSING
            # A shape that is not finite is the worst.
            self.errors[number] = np.maximum(self.errors[number], np.nan_to_num(squared, nan=1e6, posinf=1e6))
        offset = by_methods[0].shape.points - by_methods[1].shape.points
        self.apart = np.fmax(self.apart, np.sqrt(dots(offset, offset)))

    def of_sources(self, sources: np.ndarray, count: int) -> VertexErrors:
        """Returns those of other vertices, each the worst of those that stand for it.

        sources  int [n, 2], pairs of one of `count` vertices and one of these
        """
        of, own = sources.T
        result = VertexErrors(np.ones(count))
        result.thickness = np.zeros(count)
        for values, found in (
            (result.thickness, self.thickness),
            (result.apart, self.apart),
            *zip(result.errors, self.errors, strict=True),
        ):
            np.maximum.at(values, of, found[own])
        return result


def shares(
    points: np.ndarray, triangles: np.ndarray, found: VertexErrors, smoothing: float
) -> Generator[float, None, np.ndarray]:
    """Yields 1.0 between steps; returns float64 [vertices] from 0 to 1, the share of the second method.

    points     float [vertices, 3], at rest; vertices at one place get one share
    triangles  int [triangles, 3]
    smoothing  how far a change from one method to the other reaches, in thicknesses

    The shares w minimise the sum over the surface of c (w - t)^2 + k w^2 + (l |grad w|)^2: t is 1 where the
    second method's error is smaller, else 0, c how sure that is, k how little it matters, l the length of
    smoothing. As no term is negative off the diagonal, w lies between 0 and 1.
    """
    standing, places = np.unique(coincident_vertices(points), return_inverse=True)
    places = places.ravel()
    vertices = np.arange(len(points))
    at = found.of_sources(np.column_stack([places, vertices]), len(standing))
    first, second = np.sqrt(at.errors)
    visible = at.apart / (at.apart + ALIKE * at.thickness)
    differ = np.abs(first - second)
    sure = visible * differ / (differ + SURE)
    to_first = TO_FIRST * (1.0 - visible) + LEAST
    surface = _Surface(points[standing], places[triangles])
    lengths = np.maximum(smoothing * at.thickness, surface.edge_lengths if smoothing > 0.0 else 0.0)
    wanted = (second < first).astype(np.float64)
    solved = yield from surface.solve(sure + to_first, sure * wanted, lengths)
    solved[solved < SMALLEST] = 0.0
    solved[solved > 1.0 - SMALLEST] = 1.0
    return solved[places]


class _Surface:
    """A triangle mesh with its Laplace operator by cotangents.

    edges         int [2, n], each once for each of its triangles
    cotangents    float64 [n], half of them, none negative
    areas         float64 [vertices], a third of the triangles around each
    edge_lengths  float64 [vertices], the mean of the edges at each
    """

    def __init__(self, points: np.ndarray, triangles: np.ndarray) -> None:
        count, by_axis = len(points), np.ascontiguousarray(points.T, dtype=np.float64)
        corners = np.ascontiguousarray(triangles.T, dtype=np.int64)
        starts, stops = (
            np.concatenate(np.roll(corners, -1, axis=0)),
            np.concatenate(np.roll(corners, 1, axis=0)),
        )
        apexes = np.concatenate(corners)
        a, b, c = (by_axis.take(each, axis=1) for each in (starts, stops, apexes))
        normals = cross(a - c, b - c)
        doubled = np.sqrt(dots(normals, normals))
        flat = doubled <= 1e-9 * (dots(a - c, a - c) + dots(b - c, b - c))
        cotangents = dots(a - c, b - c) / np.where(flat, 1.0, doubled)
        self.edges = np.stack([starts, stops])
        self.cotangents = 0.5 * np.where(flat, 0.0, cotangents.clip(0.0, 1e2))
        self.areas = np.bincount(apexes, doubled / 6.0, count)
        # Vertices without faces decide alone.
        self.areas[self.areas <= 0.0] = self.areas[self.areas > 0.0].min(initial=1.0)
        lengths = np.sqrt(dots(a - b, a - b))
        ends = self.edges.ravel()
        degrees = np.bincount(ends, minlength=count).clip(min=1)
        self.edge_lengths = np.bincount(ends, np.tile(lengths, 2), count) / degrees

    def solve(
        self, screening: np.ndarray, sides: np.ndarray, lengths: np.ndarray
    ) -> Generator[float, None, np.ndarray]:
        """Yields 1.0 between steps; returns w of (M screening + L) w = M sides, float64 [vertices].

        lengths  [vertices], of smoothing: those of both ends scale L

        By conjugate gradients, preconditioned by the diagonal.
        """
        starts, stops = self.edges
        weights = self.cotangents * lengths[starts] * lengths[stops]
        count = len(self.areas)
        diagonal = self.areas * screening + np.bincount(self.edges.ravel(), np.tile(weights, 2), count)

        def applied(w: np.ndarray) -> np.ndarray:
            return (
                diagonal * w
                - np.bincount(starts, weights * w[stops], count)
                - np.bincount(stops, weights * w[starts], count)
            )

        solved = sides / screening
        left = self.areas * sides - applied(solved)
        direction = toward = left / diagonal
        size = first = float(left @ toward)
        step = 0
        while size > TOLERANCE**2 * first and step < count:
            along = applied(direction)
            length = size / float(direction @ along)
            solved += length * direction
            left -= length * along
            toward = left / diagonal
            size, before = float(left @ toward), size
            direction = toward + size / before * direction
            step += 1
            if step % STEPS_AT_ONCE == 0:
                yield 1.0
        return solved.clip(0.0, 1.0)
