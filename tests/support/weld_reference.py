# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes whose vertices at one place count as one where all that they are given agrees, for the oracles of
what smooths over the surface."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np


def standing_for(points: np.ndarray, *others: Iterable) -> list[int]:
    """For each vertex the first one at its place that is alike.

    others  each with something comparable for each vertex
    """
    first: dict[tuple, int] = {}
    places = (tuple(map(float, point)) for point in points)
    return [first.setdefault(key, vertex) for vertex, key in enumerate(zip(places, *others, strict=True))]


def rows_of(offsets: np.ndarray, bones: np.ndarray, weights: np.ndarray) -> list[tuple]:
    """The bones and weights of each vertex."""
    pairs = list(zip(bones.tolist(), weights.tolist(), strict=True))
    return [tuple(pairs[begin:end]) for begin, end in pairwise(offsets)]


def smoothed_by_places(
    smooth: Callable[..., np.ndarray],
    first: list[int],
    points: np.ndarray,
    faces: list[list[int]],
    edges: np.ndarray,
    weights: np.ndarray | None,
) -> np.ndarray:
    """What `smooth` makes of the mesh of the places, at all their vertices. Vertices of a place that are
    apart stay apart.

    smooth  takes the vertices of the places, points, faces, edges and weights of that mesh
    """
    kept = sorted(set(first))
    place = np.searchsorted(kept, first)
    welded = [
        [p for p, after in zip(f, f[1:] + f[:1], strict=True) if p != after]
        for f in (place[f].tolist() for f in faces)
    ]
    joined = {
        tuple(sorted(edge)) for edge in place[np.reshape(edges, (-1, 2))].tolist() if edge[0] != edge[1]
    }
    start = points[kept]
    result = smooth(
        kept,
        start,
        [face for face in welded if len(face) > 2],
        np.array(sorted(joined), np.int32).reshape(-1, 2),
        None if weights is None else weights[kept],
    )
    return points + (result - start)[place]
