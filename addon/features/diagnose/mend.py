# SPDX-License-Identifier: GPL-3.0-or-later
"""Mends the weights of chosen vertices, without changing groups that the artist has locked."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...skinning.influences import GroupWeights

# The weight in each group, by the group's index, in stored order.
Row = dict[int, float]
# For each mended vertex.
Rows = dict[int, Row]
SMOOTH_STEPS, SMOOTH_FACTOR = 5, 0.5
# Smaller weights are dropped after smoothing.
LEAST_WEIGHT = 1e-3


class WeightMender:
    """Computes new weights for some vertices of a mesh. Groups without a bone and locked groups never change;
    to get a sum of 1, only the other groups are scaled."""

    def __init__(self, weights: GroupWeights, is_bone: np.ndarray, is_locked: np.ndarray) -> None:
        """is_bone, is_locked: bool [groups]."""
        self._weights = weights
        self._is_bone = is_bone
        self._is_free = is_bone & ~is_locked
        self._starts = np.concatenate([[0], np.cumsum(weights.counts)])

    def limited(self, vertices: Iterable[int], limit: int) -> Rows:
        """Limits vertices to `limit` bones each: the smallest weights are removed, and the others scaled to a
        sum of 1."""
        return {vertex: self._limited(self._row(vertex), limit) for vertex in vertices}

    def normalized(self, vertices: Iterable[int]) -> Rows:
        """Scales weights to a sum of 1; a vertex without weights keeps none."""
        return {vertex: self._normalized(self._row(vertex)) for vertex in vertices}

    def smoothed(self, vertices: Sequence[int], edges: np.ndarray, limit: int) -> Rows:
        """Moves each weight half of the way to the mean of its neighbours', SMOOTH_STEPS times, while the
        other vertices are fixed. Afterwards at most `limit` bones.

        edges  int [edges, 2]
        """
        neighbours = _neighbours(vertices, edges)
        around = {vertex for own in neighbours.values() for vertex in own}
        rows = {vertex: self._row(vertex) for vertex in around.union(vertices)}
        for _step in range(SMOOTH_STEPS):
            mixed = {
                vertex: self._mixed(rows[vertex], [rows[other] for other in neighbours[vertex]])
                for vertex in vertices
                if neighbours[vertex]
            }
            rows |= mixed
        return {vertex: self._limited(rows[vertex], limit) for vertex in vertices}

    def without(self, vertices: Sequence[int], group: int, edges: np.ndarray, limit: int) -> Rows:
        """Takes the weights of a group away and scales the others to a sum of 1. Vertices that have no other
        are filled in as by filled(), and left out where they can not be.

        edges  int [edges, 2]
        """
        rows = {}
        for vertex in vertices:
            row = self._row(vertex)
            if group in row:
                rows[vertex] = self._normalized({g: w for g, w in row.items() if g != group})
        bare = [vertex for vertex, row in rows.items() if self._free_sum(row) <= 0.0]
        known = {vertex: row for vertex, row in rows.items() if vertex not in set(bare)}
        return known | self.filled(bare, edges, limit, known)

    def filled(
        self, vertices: Sequence[int], edges: np.ndarray, limit: int, others: Mapping[int, Row] | None = None
    ) -> Rows:
        """Fills in the mean of the neighbours that have weights, from the border of the vertices inwards;
        vertices that are not connected to any weighted vertex are left out.

        edges   int [edges, 2]
        others  rows that replace those of other vertices
        """
        neighbours = _neighbours(vertices, edges)
        open_ones: set[int] = set(vertices)
        found: Rows = {}
        known_rows = others or {}
        while True:
            layer = {}
            for vertex in sorted(open_ones):
                rows = [
                    found.get(v) or known_rows.get(v) or self._row(v)
                    for v in neighbours[vertex]
                    if v not in open_ones
                ]
                known = [row for row in rows if self._free_sum(row) > 0.0]
                if known:
                    layer[vertex] = self._limited(self._replaced(self._row(vertex), _mean(known)), limit)
            if not layer:
                return found
            found |= layer
            open_ones -= layer.keys()

    def mirrored(self, sources: Mapping[int, int], mirror_of: Sequence[int]) -> Rows:
        """Copies the weights of other vertices, each to the group of the other side.

        sources    the vertex on the other side, by the mended vertex
        mirror_of  [groups], the group of the other side, or the group itself
        """
        rows = {}
        for vertex, source in sources.items():
            other: dict[int, float] = {}
            for group, weight in self._row(source).items():
                if self._is_bone[group]:
                    target = mirror_of[group]
                    other[target] = max(weight, other.get(target, 0.0))
            if sum(other.values()) > 0.0:
                rows[vertex] = self._replaced(self._row(vertex), other)
        return rows

    def _row(self, vertex: int) -> dict[int, float]:
        own = slice(self._starts[vertex], self._starts[vertex + 1])
        groups, weights = self._weights.groups[own].tolist(), self._weights.weights[own].tolist()
        # A mesh whose groups were deleted can still have indices beyond the last group.
        return {g: w for g, w in zip(groups, weights, strict=True) if g < len(self._is_bone)}

    def _free_sum(self, row: Mapping[int, float]) -> float:
        return sum(weight for group, weight in row.items() if self._is_free[group])

    def _limited(self, row: dict[int, float], limit: int) -> dict[int, float]:
        locked = sum(self._is_bone[g] and not self._is_free[g] and w > 0.0 for g, w in row.items())
        free = sorted((g for g in row if self._is_free[g]), key=lambda g: -row[g])
        kept = set(free[: max(limit - int(locked), 0)])
        return self._normalized({g: w for g, w in row.items() if not self._is_free[g] or g in kept})

    def _normalized(self, row: dict[int, float]) -> dict[int, float]:
        total = self._free_sum(row)
        if total <= 0.0:
            return row
        locked = sum(w for g, w in row.items() if self._is_bone[g] and not self._is_free[g])
        scale = max(1.0 - locked, 0.0) / total
        return {g: w * scale if self._is_free[g] else w for g, w in row.items()}

    def _replaced(self, row: Mapping[int, float], weights: Mapping[int, float]) -> dict[int, float]:
        """Returns the row with other weights in its free groups."""
        kept = {g: w for g, w in row.items() if not self._is_free[g]}
        return kept | {g: w for g, w in weights.items() if self._is_free[g]}

    def _mixed(self, row: Mapping[int, float], others: Sequence[Mapping[int, float]]) -> dict[int, float]:
        mean = _mean(others)
        # The row's own groups first, in stored order.
        groups = [g for g in dict.fromkeys((*row, *mean)) if self._is_free[g]]
        weights = {
            g: (1.0 - SMOOTH_FACTOR) * row.get(g, 0.0) + SMOOTH_FACTOR * mean.get(g, 0.0) for g in groups
        }
        return self._replaced(row, {g: w for g, w in weights.items() if w >= LEAST_WEIGHT})


def _mean(rows: Sequence[Mapping[int, float]]) -> dict[int, float]:
    found: dict[int, float] = {}
    for row in rows:
        for group, weight in row.items():
            found[group] = found.get(group, 0.0) + weight / len(rows)
    return found


def _neighbours(vertices: Sequence[int], edges: np.ndarray) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {int(vertex): [] for vertex in vertices}
    touching = edges[np.isin(edges, np.asarray(vertices)).any(axis=1)]
    for a, b in touching.tolist():
        if a in found:
            found[a].append(b)
        if b in found:
            found[b].append(a)
    return found
