# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups as stored, and the influences made from them, to which a deformer is bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .arrays import OfArrays

# A vertex whose weights have this sum or less is not deformed (Blender's Armature modifier).
SMALLEST_WEIGHT_SUM = np.float32(1e-4)


def owners_of(counts: np.ndarray) -> np.ndarray:
    """int [items]: the number of the list that each item is in, for lists of so many items."""
    return np.repeat(np.arange(len(counts)), counts)


def offsets_of(counts: np.ndarray) -> np.ndarray:
    """int32 [lists + 1]: the first item of each list, then the end."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)


def items_of(begins: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """int [items]: the numbers of the items of several lists, one list after another."""
    return np.repeat(begins - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())


@dataclass(frozen=True)
class GroupWeights(OfArrays):
    """The vertex groups of a mesh as Blender stores them.

    counts   int32 [vertices], entries of each vertex
    groups   int32 [entries], the group's index; entries of a vertex in stored order
    weights  float32 [entries]
    """

    counts: np.ndarray
    groups: np.ndarray
    weights: np.ndarray

    @classmethod
    def none(cls, vertices: int) -> GroupWeights:
        empty = np.empty(0, dtype=np.int32)
        return cls(np.zeros(vertices, dtype=np.int32), empty, empty.astype(np.float32))

    def of_group(self, group: int) -> np.ndarray:
        """float32 [vertices]: each vertex's weight in one group, 0 where it is not in the group."""
        chosen = self.groups == group
        result = np.zeros(len(self.counts), dtype=np.float32)
        result[owners_of(self.counts)[chosen]] = self.weights[chosen]
        return result


@dataclass(frozen=True)
class Entries:
    """Entries of groups that belong to a bone, including those of weight 0.

    counts   int32 [vertices], entries of each vertex
    bones    int32 [entries]
    weights  float32 [entries]
    """

    counts: np.ndarray
    bones: np.ndarray
    weights: np.ndarray

    @property
    def vertices(self) -> np.ndarray:
        """int [entries]: the vertex of each entry."""
        return owners_of(self.counts)

    def influences(self) -> Influences:
        """The entries that deform: without those of weight 0, and without vertices whose weights have a sum
        of SMALLEST_WEIGHT_SUM or less. In stored order, on which dual quaternions depend."""
        vertices = self.vertices
        sums = np.bincount(vertices, weights=self.weights, minlength=len(self.counts))
        kept = (self.weights > 0) & (sums > SMALLEST_WEIGHT_SUM)[vertices]
        if kept.all():
            return Influences(offsets_of(self.counts), self.bones, self.weights)
        counts = np.bincount(vertices[kept], minlength=len(self.counts))
        return Influences(offsets_of(counts), self.bones[kept], self.weights[kept])


@dataclass(frozen=True)
class Influences:
    """Which bones move each vertex, and how much.

    offsets  int32 [vertices + 1], the first influence of each vertex, then the end
    bones    int32 [influences]
    weights  float32 [influences], > 0, of any sum
    """

    offsets: np.ndarray
    bones: np.ndarray
    weights: np.ndarray

    @property
    def counts(self) -> np.ndarray:
        """int [vertices]: influences of each vertex."""
        return np.diff(self.offsets)

    def distance_from(self, other: Influences) -> float:
        """The largest difference of a weight; both have the same number of vertices."""
        bones = 1 + max(int(each.bones.max(initial=0)) for each in (self, other))
        keys = [owners_of(each.counts) * bones + each.bones for each in (self, other)]
        found, at = np.unique(np.concatenate(keys), return_inverse=True)
        signed = np.concatenate([self.weights, -other.weights])
        return float(np.abs(np.bincount(at, signed, minlength=len(found))).max(initial=0.0))

    def padded(self) -> tuple[np.ndarray, np.ndarray]:
        """int and float64 [vertices, slots]: bones and weights, the heaviest first and equal ones in their
        order, padded with -1 and 0."""
        counts = self.counts
        vertices = owners_of(counts)
        order = np.lexsort((-self.weights, vertices))
        slots = np.arange(len(vertices)) - np.repeat(self.offsets[:-1], counts)
        bones = np.full((len(counts), counts.max(initial=1)), -1)
        weights = np.zeros(bones.shape)
        bones[vertices, slots], weights[vertices, slots] = self.bones[order], self.weights[order]
        return bones, weights

    def heaviest(self, most: int) -> Influences:
        """Without those of each vertex that `most` of its others exceed."""
        bones, weights = self.padded()
        return Influences.of_padded(bones[:, :most], weights[:, :most], bones[:, :most] >= 0)

    @classmethod
    def of_padded(cls, bones: np.ndarray, weights: np.ndarray, kept: np.ndarray) -> Influences:
        """Of bones and weights [vertices, slots] those that are `kept`, bool, in their order."""
        offsets = offsets_of(kept.sum(axis=1))
        return cls(offsets, bones[kept].astype(np.int32), weights[kept].astype(np.float32))

    def of_vertices(self, vertices: np.ndarray) -> Influences:
        """Those of some vertices, int [n], in this order."""
        counts = self.counts[vertices]
        items = items_of(self.offsets[vertices], counts)
        return Influences(offsets_of(counts), self.bones[items], self.weights[items])

    def blended(self, motions: np.ndarray, points: np.ndarray) -> np.ndarray:
        """float64 [vertices, 3]: linear blend skinning. Vertices without influences stay.

        motions  float64 [bones, 3, 4] or [bones, 4, 4], from rest, in the space of the points
        points   [vertices, 3]
        """
        counts = self.counts
        vertices = owners_of(counts)
        weights = self.weights.astype(np.float64)
        weights /= np.bincount(vertices, weights, minlength=len(counts))[vertices]
        result = points.astype(np.float64)
        moved = motions[self.bones, :3, 3] + np.einsum(
            "nij,nj->ni", motions[self.bones, :3, :3], result[vertices]
        )
        result[counts > 0] = 0.0
        for axis in range(3):
            result[:, axis] += np.bincount(vertices, weights * moved[:, axis], minlength=len(counts))
        return result


def joined(parts: Sequence[Influences], bone_counts: Sequence[int]) -> Influences:
    """Returns the influences of several meshes as one; vertices and bones are concatenated.

    bone_counts  of each part, including joints of bendy bones
    """
    offsets, bones, first_influence, first_bone = [np.zeros(1, np.int32)], [], 0, 0
    for part, count in zip(parts, bone_counts, strict=True):
        offsets.append(part.offsets[1:] + first_influence)
        bones.append(part.bones + first_bone)
        first_influence += len(part.bones)
        first_bone += count
    weights = [part.weights for part in parts]
    return Influences(np.concatenate(offsets), np.concatenate(bones), np.concatenate(weights))


def entries_of_bones(groups: GroupWeights, bone_of_group: np.ndarray) -> Entries:
    """Returns the entries of groups that belong to a bone.

    bone_of_group  int32 [groups], the bone of each group, -1 for none
    """
    table = np.append(bone_of_group.astype(np.int32), np.int32(-1))
    # A mesh whose groups were deleted can still have indices beyond the last group.
    bones = table[np.minimum(groups.groups, len(table) - 1)]
    kept = bones >= 0
    if kept.all():
        return Entries(groups.counts, bones, groups.weights)
    counts = np.bincount(owners_of(groups.counts)[kept], minlength=len(groups.counts)).astype(np.int32)
    return Entries(counts, bones[kept], groups.weights[kept])
