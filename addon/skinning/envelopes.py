# SPDX-License-Identifier: GPL-3.0-or-later
"""Bone envelopes: the volume around a bone at rest within which it moves vertices.

Based on what Blender's Armature modifier does with Bone Envelopes and Envelope Multiply.
"""

from dataclasses import dataclass

import numpy as np

from .arrays import OfArrays
from .influences import Entries


@dataclass(frozen=True)
class Envelopes(OfArrays):
    """The envelopes of all bones at rest, in armature space.

    heads, tails              float32 [bones, 3]
    head_radii, tail_radii    float32 [bones], full weight up to this distance from the bone
    distances                 float32 [bones], the weight falls to 0 over this distance beyond the radius
    weights                   float32 [bones], weight of a vertex that has no groups
    multiply                  bool [bones], the envelope scales the bone's group weights
    """

    heads: np.ndarray
    tails: np.ndarray
    head_radii: np.ndarray
    tail_radii: np.ndarray
    distances: np.ndarray
    weights: np.ndarray
    multiply: np.ndarray

    def reach(self, points: np.ndarray, bones: np.ndarray) -> np.ndarray:
        """float64 [n] in 0..1: the weight of points[i] ([n, 3], armature space) in the envelope of
        bones[i]."""
        head = self.heads[bones].astype(np.float64)
        axis = self.tails[bones] - head
        length = np.linalg.norm(axis, axis=1)
        axis = np.divide(axis, length[:, None], out=np.zeros_like(axis), where=length[:, None] > 0.0)
        from_head = points - head
        along = np.einsum("ij,ij->i", from_head, axis)
        share = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0).clip(0.0, 1.0)
        nearest = share[:, None] * length[:, None] * axis
        distance = np.linalg.norm(from_head - nearest, axis=1)
        radius = (1.0 - share) * self.head_radii[bones] + share * self.tail_radii[bones]
        fade = self.distances[bones].astype(np.float64)
        past = np.divide(distance - radius, fade, out=np.ones_like(distance), where=fade > 0.0)
        return np.where(distance < radius, 1.0, 1.0 - past.clip(0.0, 1.0) ** 2)


def multiply_by_envelopes(entries: Entries, envelopes: Envelopes, points: np.ndarray) -> Entries:
    """Returns the entries, where envelopes scale the weights of bones that have Envelope Multiply.

    points  [vertices, 3], armature space
    """
    scaled = envelopes.multiply[entries.bones]
    weights = entries.weights.copy()
    reach = envelopes.reach(points[entries.vertices[scaled]].astype(np.float64), entries.bones[scaled])
    weights[scaled] *= reach.astype(np.float32)
    return Entries(entries.counts, entries.bones, weights)


def fill_from_envelopes(
    entries: Entries, envelopes: Envelopes, deform: np.ndarray, points: np.ndarray
) -> Entries:
    """Returns the entries; vertices without entries get one for every envelope that reaches them.

    An entry of weight 0 counts as an entry: such a vertex gets no others.

    deform  bool [bones]
    points  [vertices, 3], armature space
    """
    bare = np.flatnonzero(entries.counts == 0)
    candidates = np.flatnonzero(deform)
    vertices, bones = (grid.ravel() for grid in np.meshgrid(bare, candidates, indexing="ij"))
    weights = envelopes.reach(points[vertices].astype(np.float64), bones) * envelopes.weights[bones]
    reached = weights > 0.0
    # A stable sort by vertex keeps the order of bones and groups.
    all_vertices = np.concatenate([entries.vertices, vertices[reached]])
    order = np.argsort(all_vertices, kind="stable")
    return Entries(
        np.bincount(all_vertices, minlength=len(entries.counts)).astype(np.int32),
        np.concatenate([entries.bones, bones[reached].astype(np.int32)])[order],
        np.concatenate([entries.weights, weights[reached].astype(np.float32)])[order],
    )
