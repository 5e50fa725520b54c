# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices at one place that the same bones move alike count as one: a mesh that an exporter split at its
seams is smoothed like a whole one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .influences import Influences, items_of, owners_of
from .stage_mesh import Topology
from .surface import coincident_vertices


@dataclass(frozen=True)
class Weld:
    """first   int [places], ascending: the vertex that stands for each place
    places  int [vertices], each vertex's place
    """

    first: np.ndarray
    places: np.ndarray

    def topology(self, topology: Topology) -> Topology:
        """Returns the faces and edges of the places: without edges that join a place to itself, and without
        faces of fewer than three places."""
        counts = np.diff(topology.face_offsets)
        corners, edges = self.places[topology.corner_vertices], np.sort(self.places[topology.edges], axis=1)
        faces, following = owners_of(counts), np.arange(1, len(corners) + 1)
        some = counts > 0
        following[topology.face_offsets[1:][some] - 1] = topology.face_offsets[:-1][some]
        kept = corners != corners[following]
        kept &= (np.bincount(faces[kept], minlength=len(counts)) > 2)[faces]
        offsets = np.cumsum(np.bincount(faces[kept] + 1, minlength=len(counts) + 1), dtype=np.int32)
        keys = np.unique(edges[edges[:, 0] != edges[:, 1]].astype(np.int64) @ [len(self.first), 1])
        edges = np.column_stack(np.divmod(keys, len(self.first))).astype(np.int32)
        return Topology(offsets, corners[kept].astype(np.int32), edges)

    def triangles(self, triangles: np.ndarray) -> np.ndarray:
        """int32 [welded triangles, 3]: without those of fewer than three places."""
        corners = self.places[triangles].astype(np.int32)
        return np.ascontiguousarray(corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)])

    def rows_of_vertices(self, rows: np.ndarray) -> np.ndarray:
        """Returns the rows of all vertices, from rows of places that begin with the place, ascending."""
        of_place = rows[:, 0].astype(np.int64)
        begins = np.searchsorted(of_place, np.arange(len(self.first)))[self.places]
        counts = np.bincount(of_place, minlength=len(self.first))[self.places]
        found = rows[items_of(begins, counts)]
        found[:, 0] = owners_of(counts)
        return found


def weld(
    points: np.ndarray, moved_by: Sequence[Influences], masks: Sequence[np.ndarray | None] = ()
) -> Weld | None:
    """Returns None where no two vertices are one.

    points    float [vertices, 3], at rest
    moved_by  of each Armature modifier
    masks     [vertices], numbers in which vertices that are one agree, too
    """
    first = coincident_vertices(points)
    some = np.flatnonzero(np.bincount(first, minlength=len(points))[first] > 1)
    if not len(some):
        return None
    columns = [first[some, None], *(mask[some, None] for mask in masks if mask is not None)]
    for rows in moved_by:
        counts = rows.counts[some]
        begins = np.cumsum(rows.counts)[some] - counts
        places = np.arange(counts.max())
        is_there = places < counts[:, None]
        items = np.where(is_there, begins[:, None] + places, 0)
        columns += [np.where(is_there, rows.bones[items], -1), np.where(is_there, rows.weights[items], 0.0)]
    _, alike, of_kind = np.unique(np.hstack(columns), axis=0, return_index=True, return_inverse=True)
    first = np.arange(len(points))
    first[some] = some[alike][of_kind.ravel()]
    standing, places = np.unique(first, return_inverse=True)
    return Weld(standing, places.ravel()) if len(standing) < len(points) else None
