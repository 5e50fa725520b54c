# SPDX-License-Identifier: GPL-3.0-or-later
"""The topology of a mesh as measures need it, computed once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .vectors import cross, dots


@dataclass(frozen=True)
class Surface:
    """The topology of a mesh, or of several that are measured as one.

    vertex_count  of all meshes
    triangles     int32 [triangles, 3], counter-clockwise seen from outside
    edges         int32 [edges, 2], the mesh's own: no diagonals of its quads
    coincident    int [vertices], the first vertex at the same position at rest; None where no two coincide.
                  Game files split vertices at seams of texture coordinates, which are no holes
    """

    vertex_count: int
    triangles: np.ndarray
    edges: np.ndarray
    coincident: np.ndarray | None = None

    @cached_property
    def corners(self) -> np.ndarray:
        """int64 [3, triangles]: each corner's vertex, stored corner by corner."""
        return np.ascontiguousarray(self.triangles.T, dtype=np.int64)

    @cached_property
    def ends(self) -> np.ndarray:
        """int64 [2, edges]: each end's vertex."""
        return np.ascontiguousarray(self.edges.T, dtype=np.int64)

    @cached_property
    def edges_around(self) -> EdgesAround:
        ends = self.ends.ravel()
        order = np.argsort(ends, kind="stable")
        vertices, starts = np.unique(ends[order], return_index=True)
        return EdgesAround(vertices, starts, order % max(len(self.edges), 1))

    @cached_property
    def _directed_edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Directed edges of triangles as int64 [n], start * vertex_count + end: those without an opposite
        edge, as often as it is missing, and those that occur more than once."""
        corners = self.corners if self.coincident is None else self.coincident[self.corners]
        starts, stops = corners.ravel(), np.roll(corners, -1, axis=0).ravel()
        keys, counts = np.unique(starts * self.vertex_count + stops, return_counts=True)
        opposite = keys % self.vertex_count * self.vertex_count + keys // self.vertex_count
        at = np.searchsorted(keys, opposite).clip(max=max(len(keys) - 1, 0))
        found = keys[at] == opposite if len(keys) else np.zeros(0, dtype=bool)
        missing = counts - np.where(found, counts[at], 0)
        # Faces that are an edge or a point at rest.
        missing[keys == opposite] = 0
        return np.repeat(keys, missing.clip(min=0)), keys[counts > 1]

    @cached_property
    def neighbours(self) -> np.ndarray:
        """int64 [2, n]: pairs of triangles with a common edge."""
        keys = np.sort(np.stack([self.corners, np.roll(self.corners, -1, axis=0)]), axis=0)
        flat = (keys[0] * self.vertex_count + keys[1]).ravel()
        order = np.argsort(flat, kind="stable")
        same = np.flatnonzero(flat[order[1:]] == flat[order[:-1]])
        return np.stack([order[same], order[same + 1]]) % max(len(self.triangles), 1)

    @property
    def clash_count(self) -> int:
        """The number of directed edges that two triangles share: their normals disagree, or the edge has more
        than two faces. The volume then means little."""
        return len(self._directed_edges[1])

    @cached_property
    def caps(self) -> Caps:
        """The fans that close the holes."""
        borders = self._directed_edges[0]
        return Caps.over(borders // self.vertex_count, borders % self.vertex_count)


@dataclass(frozen=True)
class EdgesAround:
    """The edges at each vertex, vertex by vertex.

    vertices  int64 [n], those that have edges
    starts    int64 [n], the index in `edges` of the first edge of each
    edges     int64 [2 edges]
    """

    vertices: np.ndarray
    starts: np.ndarray
    edges: np.ndarray


@dataclass(frozen=True)
class Caps:
    """A fan of triangles over each hole, from its border to the mean of its border's vertices.

    starts, stops  int64 [borders], the border's vertices, in the direction of the mesh's own triangles
    vertices       int64 [n], the vertices of all borders
    holes          int64 [n], the hole that each belongs to; borders that touch are one hole
    hole_of        int64 [borders]
    count          of holes
    """

    starts: np.ndarray
    stops: np.ndarray
    vertices: np.ndarray
    holes: np.ndarray
    hole_of: np.ndarray
    count: int

    @classmethod
    def over(cls, starts: np.ndarray, stops: np.ndarray) -> Caps:
        vertices, index = np.unique(np.concatenate([starts, stops]), return_inverse=True)
        pairs = index.reshape(2, -1).T
        numbers, holes = np.unique(components(len(vertices), pairs), return_inverse=True)
        return cls(starts, stops, vertices, holes, holes[pairs[:, 0]], len(numbers))

    def volumes(self, points: np.ndarray) -> np.ndarray:
        """float64 [holes]: six times the volume that each fan adds, for float64 points [3, vertices]."""
        if self.count == 0:
            return np.zeros(0)
        sizes = np.bincount(self.holes, minlength=self.count)
        centres = np.stack(
            [np.bincount(self.holes, axis[self.vertices], self.count) / sizes for axis in points]
        )
        a, b, c = points[:, self.stops], points[:, self.starts], centres[:, self.hole_of]
        return np.bincount(self.hole_of, dots(a, cross(b, c)), self.count)


@dataclass(frozen=True)
class Parts:
    """Parts of a surface, each closed by fans where it ends.

    surface    of all parts, which share no vertices
    vertices   int64 [vertices], the numbers of its vertices in the whole surface
    triangles  int64 [triangles], the numbers of its triangles there
    part_of    int64 [triangles], from 0
    """

    surface: Surface
    vertices: np.ndarray
    triangles: np.ndarray
    part_of: np.ndarray

    @classmethod
    def of(cls, whole: Surface, numbers: np.ndarray) -> Parts:
        """numbers: int [triangles], the part of each triangle of the whole; -1 for none."""
        taken = numbers >= 0
        _numbers, part_of = np.unique(numbers[taken], return_inverse=True)
        first_of_part = part_of[:, None].astype(np.int64) * whole.vertex_count
        keys, corners = np.unique(first_of_part + whole.triangles[taken], return_inverse=True)
        vertices = keys % whole.vertex_count
        at_same_place = keys
        if whole.coincident is not None:
            at_same_place = keys - vertices + whole.coincident[vertices]
        _keys, first, index = np.unique(at_same_place, return_index=True, return_inverse=True)
        no_edges = np.empty((0, 2), np.int32)
        surface = Surface(len(keys), corners.reshape(-1, 3), no_edges, first[index])
        return cls(surface, vertices, np.flatnonzero(taken), part_of)

    @cached_property
    def _part_of_hole(self) -> np.ndarray:
        caps, of_vertices = self.surface.caps, np.zeros(len(self.vertices), np.int64)
        of_vertices[self.surface.triangles] = self.part_of[:, None]
        result = np.zeros(caps.count, np.int64)
        result[caps.holes] = of_vertices[caps.vertices]
        return result

    def volumes(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """float64 [parts], for points [3, vertices] of the whole surface, with its normals [3, triangles], of
        twice the triangles' areas."""
        own = points.take(self.vertices, axis=1)
        own -= own.mean(axis=1, keepdims=True) if len(self.vertices) else 0.0
        heights = dots(own.take(self.surface.corners[0], axis=1), normals.take(self.triangles, axis=1))
        count = int(self.part_of.max(initial=-1)) + 1
        inside = np.bincount(self.part_of, heights, count)
        return (inside + np.bincount(self._part_of_hole, self.surface.caps.volumes(own), count)) / 6.0


def components(count: int, pairs: np.ndarray) -> np.ndarray:
    """int [count]: for each, the lowest of those that pairs [n, 2] join it with."""
    lowest = np.arange(count)
    while len(pairs):
        least = np.minimum(lowest[pairs[:, 0]], lowest[pairs[:, 1]])
        spread = lowest.copy()
        for end in (0, 1):
            np.minimum.at(spread, lowest[pairs[:, end]], least)
            np.minimum.at(spread, pairs[:, end], least)
        # Pointer doubling keeps the number of rounds small.
        spread = spread[spread]
        if np.array_equal(spread, lowest):
            break
        lowest = spread
    return lowest


def joined(surfaces: Sequence[Surface]) -> Surface:
    """Returns several meshes as one; vertices are concatenated."""
    triangles, edges, coincident, first = [], [], [], 0
    for surface in surfaces:
        triangles.append(surface.triangles + first)
        edges.append(surface.edges + first)
        own = surface.coincident
        coincident.append((np.arange(surface.vertex_count) if own is None else own) + first)
        first += surface.vertex_count
    return Surface(first, *map(np.concatenate, (triangles, edges, coincident)))


def coincident_vertices(points: np.ndarray) -> np.ndarray:
    """int [vertices]: for each of `points` [vertices, 3], the first one with exactly the same coordinates."""
    order = np.lexsort(points.T)
    ordered = points[order]
    starts = np.r_[True, (ordered[1:] != ordered[:-1]).any(axis=1)][: len(points)]
    # The sort keeps the order of equal ones.
    first = np.empty(len(points), dtype=np.int64)
    first[order] = order[np.flatnonzero(starts)[np.cumsum(starts) - 1]]
    return first
