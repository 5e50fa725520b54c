# SPDX-License-Identifier: GPL-3.0-or-later
"""A character as a whole: one surface of all its meshes, and the bones of all its armatures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...skinning.influences import Influences, owners_of
from ...skinning.surface import Surface
from ...skinning.vectors import distances_from_axes
from .metrics import Shape

SAME_PATCH = 1.0 / 3.0
"""Faults are of one place where this part of one's vertices is in the other."""


@dataclass(frozen=True)
class Place:
    """Where a measure is worst: a vertex of the character, with its point at rest."""

    vertex: int
    point: np.ndarray


@dataclass(frozen=True)
class Skeleton:
    """The bones of all armatures, in world space.

    names    [bones]
    rest     float64 [bones, 4, 4], each in its own axes
    tails    float64 [bones, 3], where their limbs end
    above    int [bones], what carries each; -1 for none
    deform   bool [bones], those that may move vertices
    roles    [bones], as battery.Battery.roles()
    side     int [bones], 1 for left, -1 for right, 0 for neither
    mirror   int [bones], the bone of the other side; -1 for none
    rig      int [bones], the armature of each
    rigs     names of armatures
    """

    names: tuple[str, ...]
    rest: np.ndarray
    tails: np.ndarray
    above: np.ndarray
    deform: np.ndarray
    roles: tuple[str, ...]
    side: np.ndarray
    mirror: np.ndarray
    rig: np.ndarray
    rigs: tuple[str, ...]

    @classmethod
    def of(cls, rest: np.ndarray, lengths: np.ndarray, above: np.ndarray) -> Skeleton:
        """One armature, whose bones' names say nothing.

        rest     float [bones, 4, 4], Y along the bone
        lengths  float [bones], in the unit of the points
        above    int [bones], the parent of each; -1 for none
        """
        count, none = len(rest), np.full(len(rest), -1)
        tails = rest[:, :3, 3] + lengths[:, None] * rest[:, :3, 1]
        names, no = tuple(map(str, range(count))), np.zeros(count, int)
        return cls(names, rest, tails, above, np.ones(count, bool), ("",) * count, no, none, no, ("rig",))

    @property
    def heads(self) -> np.ndarray:
        return self.rest[:, :3, 3]

    @cached_property
    def lengths(self) -> np.ndarray:
        return np.linalg.norm(self.tails - self.heads, axis=1)

    @cached_property
    def carried(self) -> np.ndarray:
        """bool [bones, bones]: row j has those that move with bone j, itself among them."""
        count = len(self.names)
        found = np.identity(count, bool)
        for bone in range(count):
            above, seen = int(self.above[bone]), {bone}
            while above >= 0 and above not in seen:
                found[above, bone] = True
                seen.add(above)
                above = int(self.above[above])
        return found

    def distances(self, points: np.ndarray, bones: np.ndarray) -> np.ndarray:
        """float64 [n]: of points [n, 3] from the axis of one bone each."""
        return distances_from_axes(points.T, self.heads[bones].T, (self.tails - self.heads)[bones].T)


@dataclass(frozen=True)
class Character:
    """
    surface     of all meshes
    points      float64 [vertices, 3], at rest in world space
    influences  over the columns of metrics.FrameOfRig
    bone_of     int [columns], the bone of the skeleton that each column belongs to
    meshes      names and numbers of vertices
    """

    surface: Surface
    points: np.ndarray
    influences: Influences
    bone_of: np.ndarray
    skeleton: Skeleton
    meshes: Sequence[tuple[str, int]]

    @cached_property
    def weights(self) -> np.ndarray:
        """float32 [vertices, bones], the shares of bones: rows have a sum of 1, or of 0 without weights."""
        shape = (self.surface.vertex_count, len(self.skeleton.names))
        keys = owners_of(self.influences.counts) * shape[1] + self.bone_of[self.influences.bones]
        found = np.bincount(keys, self.influences.weights, shape[0] * shape[1]).reshape(shape)
        sums = found.sum(axis=1, keepdims=True)
        return np.divide(found, sums, out=np.zeros(shape), where=sums > 0.0).astype(np.float32)

    @cached_property
    def heaviest(self) -> np.ndarray:
        """int [vertices]: the bone with the largest share; -1 without weights."""
        return np.where(self.weights.any(axis=1), self.weights.argmax(axis=1), -1)

    @cached_property
    def moving(self) -> np.ndarray:
        """bool [bones]: those that move vertices."""
        return np.asarray((self.weights > 0.0).any(axis=0))

    @cached_property
    def rest(self) -> Shape:
        return Shape(self.surface, self.points)

    @cached_property
    def diagonal(self) -> float:
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @cached_property
    def joined(self) -> np.ndarray:
        """int [edges of all triangles, 2]: neighbours, vertices at the same place at rest as one."""
        pairs = np.concatenate([self.surface.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
        if self.surface.coincident is not None:
            first = self.surface.coincident
            doubles = np.flatnonzero(first != np.arange(len(first)))
            pairs = np.concatenate([pairs, np.stack([doubles, first[doubles]], axis=1)])
        return pairs.astype(np.int64)

    def around(self, vertices: np.ndarray, rings: int) -> np.ndarray:
        """bool [vertices]: those chosen, and as many rings of neighbours."""
        found = np.zeros(self.surface.vertex_count, bool)
        found[vertices] = True
        for _ring in range(rings):
            pairs = self.joined
            found[pairs[found[pairs].any(axis=1)]] = True
        return found

    def by_mesh(self, vertices: np.ndarray) -> dict[str, np.ndarray]:
        """Numbers of the vertices in their meshes, by these meshes' names."""
        found, first = {}, 0
        for name, count in self.meshes:
            own = vertices[(vertices >= first) & (vertices < first + count)] - first
            if len(own):
                found[name] = own
            first += count
        return found

    def mesh_of(self, vertex: int) -> tuple[str, int]:
        """Returns a mesh's name, and the number of the vertex in it."""
        for name, count in self.meshes:
            if vertex < count:
                return name, vertex
            vertex -= count
        raise IndexError(vertex)


def share_in(chosen: np.ndarray, vertices: np.ndarray) -> float:
    """Of the vertices int [n], the part that is in `chosen`, bool; 0 of none."""
    return float(chosen[vertices].mean()) if len(vertices) else 0.0
