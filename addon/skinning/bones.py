# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones at rest, and what carries them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
import sinew

from .arrays import OfArrays
from .envelopes import Envelopes


@dataclass(frozen=True)
class RestBones(OfArrays):
    """The bones of an armature at rest, followed by the joints of bendy bones (see bendy.py).

    names         all bones, in Blender's order
    deform        bool [bones], those that may move vertices
    rest          float32 [bones + joints, 4, 4], armature space, each in its own axes
    lengths       float32 [bones]
    segments      int32 [bones], 1 for a bone that does not bend
    curved        bool [bones], those that map vertices along their curve
    first_joints  int32 [bones], the index in `rest` of the first of a bendy bone's segments + 1 joints
    envelopes     of all bones
    parents       int32 [bones], -1 for none
    complete      False where Blender had not computed the joints yet; bendy bones then count as straight
    skin          of a mesh, as from limbs.skin_of(); None: not known, or not needed
    """

    names: tuple[str, ...]
    deform: np.ndarray
    rest: np.ndarray
    lengths: np.ndarray
    segments: np.ndarray
    curved: np.ndarray
    first_joints: np.ndarray
    envelopes: Envelopes
    parents: np.ndarray
    complete: bool = True
    skin: np.ndarray | None = field(default=None, compare=False)

    @classmethod
    def none(cls) -> Self:
        """For a missing armature, or one in edit mode."""
        none, numbers = np.empty(0, dtype=np.float32), np.empty(0, dtype=np.int32)
        points, flags = np.empty((0, 3), dtype=np.float32), np.empty(0, dtype=bool)
        envelopes = Envelopes(points, points, none, none, none, none, flags)
        rest = np.empty((0, 4, 4), dtype=np.float32)
        return cls((), flags, rest, none, numbers, flags, numbers, envelopes, numbers)

    @cached_property
    def bend(self) -> bool:
        return bool((self.segments > 1).any())

    @cached_property
    def bending(self) -> list[tuple[int, int]]:
        """The bendy bones in the order of their joints, each with its number of segments."""
        return [(int(bone), int(self.segments[bone])) for bone in np.flatnonzero(self.segments > 1)]

    @cached_property
    def owners(self) -> np.ndarray:
        """int [bones + joints]: each bone itself, and the bendy bone of each joint."""
        joints = [np.full(segments + 1, bone) for bone, segments in self.bending]
        return np.concatenate([np.arange(len(self.names)), *joints])

    def names_with(self, joints: Mapping[int, str]) -> list[str]:
        """Names of bones and joints; empty for a joint that is given none."""
        return [*self.names, *(joints.get(joint, "") for joint in range(len(self.names), len(self.rest)))]

    @cached_property
    def rest_axes(self) -> np.ndarray:
        """`rest`, where the joints have axes of unit length, as they can be scaled. Axes of bones are
        unchanged: Blender's rounding makes them up to 4e-5 too long or short, and Blender takes that for
        scale."""
        axes = self.rest.copy()
        of_joints = axes[len(self.names) :, :3, :3]
        lengths = np.linalg.norm(of_joints, axis=1, keepdims=True)
        of_joints /= np.where(lengths > 0.0, lengths, 1.0)
        return axes

    @cached_property
    def rest_from_armature(self) -> np.ndarray:
        """float64 [bones + joints, 4, 4]: the inverses of `rest`."""
        return sinew.affine.inverse(self.rest.astype(np.float64))

    def with_skin_of(self, other: Self) -> Self:
        """Returns the same, whose skin is also that of the same bones for another mesh."""
        skins = [bones.skin for bones in (self, other) if bones.skin is not None]
        return replace(self, skin=np.sum(skins, axis=0) if skins else None)

    @cached_property
    def children(self) -> list[list[int]]:
        """The deforming bones that each deforming one carries next."""
        found: list[list[int]] = [[] for _name in self.names]
        for bone in np.flatnonzero(self.deform):
            if self.deforming_parents[bone] >= 0:
                found[self.deforming_parents[bone]].append(int(bone))
        return found

    @cached_property
    def deforming_parents(self) -> np.ndarray:
        """int32 [bones]: the deforming bone above each deforming one, and the parent of each other; -1
        for none."""
        found = [
            self._deforming_parent(bone) if deforms else int(self.parents[bone])
            for bone, deforms in enumerate(self.deform)
        ]
        return np.array(found, dtype=np.int32).reshape(-1)

    def _deforming_parent(self, bone: int) -> int:
        """The nearest deforming bone above. In rigs whose deforming bones hang on others, the one at whose
        tail the bone starts, else the one at the place of a bone above, or that alone starts there: bones
        across their limb may have others along it."""
        above = int(self.parents[bone])
        while above >= 0 and not self.deform[above]:
            above = int(self.parents[above])
        if above >= 0:
            return above
        count = len(self.names)
        heads, places = self.rest[:count, :3, 3], self.rest[:count, :3, 1:4]
        near = 1e-3 * self.lengths

        def others(apart: np.ndarray) -> np.ndarray:
            found = np.flatnonzero(self.deform & (apart <= near))
            return found[found != bone]

        tails = heads + self.lengths[:, None] * self.rest[:count, :3, 1]
        meets = others(np.linalg.norm(tails - heads[bone], axis=1))
        if len(meets) == 1:
            return int(meets[0])
        above = int(self.parents[bone])
        while above >= 0:
            alike = others(np.abs(places - places[above]).max(axis=(1, 2)))
            starting = others(np.linalg.norm(heads - heads[above], axis=1))
            if len(alike):
                return int(alike[0])
            if len(starting) == 1:
                return int(starting[0])
            above = int(self.parents[above])
        return -1

    @cached_property
    def from_the_root(self) -> list[int]:
        """The bones, each after the one that carries it."""
        order: dict[int, None] = {}
        for bone in range(len(self.names)):
            chain: list[int] = []
            # Rigs whose bones hang on others may carry each other in a circle.
            while bone >= 0 and bone not in order and bone not in chain:
                chain.append(bone)
                bone = int(self.deforming_parents[bone])
            order.update(dict.fromkeys(reversed(chain)))
        return list(order)

    def groups_without_bone(self, group_names: Sequence[str]) -> list[str]:
        """Returns the groups without a bone of the same name."""
        names = set(self.names)
        return [name for name in group_names if name not in names]

    def of_groups(self, group_names: list[str]) -> np.ndarray:
        """int32 [groups]: the deforming bone with each group's name, -1 for none."""
        index = {name: bone for bone, name in enumerate(self.names) if self.deform[bone]}
        return np.array([index.get(name, -1) for name in group_names], dtype=np.int32).reshape(-1)
