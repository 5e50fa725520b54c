# SPDX-License-Identifier: GPL-3.0-or-later
"""Bone envelopes: the reach of a bone around its rest segment.

Based on: what Blender's Armature modifier does with Bone Envelopes and Envelope Multiply.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from .influences import Entries


@dataclass(frozen=True)
class Envelopes:
    """The envelopes of all bones at rest, in armature space.

    heads, tails              float32 [bones, 3]
    head_radii, tail_radii    float32 [bones], wholly inside up to here
    distances                 float32 [bones], fading to nothing over this
    weights                   float32 [bones], strength where a vertex has no groups
    multiply                  bool [bones], the envelope scales the bone's group weights
    """

    heads: np.ndarray
    tails: np.ndarray
    head_radii: np.ndarray
    tail_radii: np.ndarray
    distances: np.ndarray
    weights: np.ndarray
    multiply: np.ndarray

    def equals(self, other: Envelopes) -> bool:
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    def reach(self, points: np.ndarray, bones: np.ndarray) -> np.ndarray:
        """float64 [n] in 0..1: how far the envelope of bones[i] holds points[i] ([n, 3], armature space)."""
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
    """The entries with the weights of Envelope Multiply bones scaled by their reach.

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
    """The entries, and for vertices that have none those of every envelope that reaches them.

    A vertex with an entry of weight zero has one: it is not filled.

    deform  bool [bones]
    points  [vertices, 3], armature space
    """
    bare = np.flatnonzero(entries.counts == 0)
    candidates = np.flatnonzero(deform)
    vertices, bones = (grid.ravel() for grid in np.meshgrid(bare, candidates, indexing="ij"))
    weights = envelopes.reach(points[vertices].astype(np.float64), bones) * envelopes.weights[bones]
    held = weights > 0.0
    # Sorted by vertex, and stable: bones stay in their order, groups in theirs.
    all_vertices = np.concatenate([entries.vertices, vertices[held]])
    order = np.argsort(all_vertices, kind="stable")
    return Entries(
        np.bincount(all_vertices, minlength=len(entries.counts)).astype(np.int32),
        np.concatenate([entries.bones, bones[held].astype(np.int32)])[order],
        np.concatenate([entries.weights, weights[held].astype(np.float32)])[order],
    )
