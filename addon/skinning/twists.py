# SPDX-License-Identifier: GPL-3.0-or-later
"""Which bones share the twist of another, found from the bones' places, names and parents."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..base.phrases import phrase
from .bones import RestBones
from .limbs import ARM, END, LEG, LOWER, MADE, NEAR, NEITHER, OWN_TWIST, STRAIGHT, UPPER, Limbs, words_of


@dataclass(frozen=True)
class Twists:
    """
    rows          int32 [twists, 4] as sinew.TwistSpread takes them, a bone before those that it carries
    heads, tails  float32 [twists, 3] of the twisted bones' limbs at rest, armature space
    bones, tips   names, [twists]
    parents       int32 [bones + joints], -1 for none
    left_out      a sentence for each bone that gets no twist though others like it do
    """

    rows: np.ndarray
    heads: np.ndarray
    tails: np.ndarray
    bones: tuple[str, ...]
    tips: tuple[str, ...]
    parents: np.ndarray
    left_out: tuple[str, ...]


class TwistFinder:
    def __init__(self, bones: RestBones, limbs: Limbs) -> None:
        self._names, self._deform, self._parents = bones.names, bones.deform, bones.parents
        self._segments, self._children = bones.segments, bones.children
        self._deforming_parents = bones.deforming_parents
        self._limbs, self._known = limbs.vectors, limbs.known
        rest = bones.rest[: len(bones.names)].astype(np.float64)
        self._heads, self._own = rest[:, :3, 3], bones.lengths[:, None] * rest[:, :3, 1]
        self._left_out: list[str] = []

    def find(self, joints: np.ndarray) -> Twists:
        """joints: int [joints], the bendy bone of each."""
        found = [row for bone in self._from_the_root() if (row := self._twist_of(bone)) is not None]
        rows = np.array(found, np.int32).reshape(-1, 4)
        of = rows[:, 0]
        return Twists(
            rows,
            self._heads[of].astype(np.float32),
            (self._heads + self._limbs)[of].astype(np.float32),
            tuple(self._names[bone] for bone in of),
            tuple(self._names[bone] for bone in rows[:, 2]),
            np.concatenate([self._parents, joints]).astype(np.int32),
            tuple(self._left_out),
        )

    def _from_the_root(self) -> list[int]:
        depths = np.zeros(len(self._names), np.int32)
        for bone in range(len(self._names)):
            above = int(self._parents[bone])
            while above >= 0:
                depths[bone] += 1
                above = int(self._parents[above])
        return [int(bone) for bone in np.argsort(depths, kind="stable") if self._deform[bone]]

    def _twist_of(self, bone: int) -> tuple[int, int, int, int] | None:
        """Returns its row, or None. Notes why, where it is a limb."""
        role = self._role(bone)
        if role == NEITHER or not self._limbs[bone].any():
            return None
        if role == UPPER:
            base = int(self._deforming_parents[bone])
            base = int(self._parents[bone]) if base < 0 else base
            if not self._known[bone]:
                text = "{bone} carries no bone and moves no skin that its axis could be told from"
                self._leave_out(bone, text)
                return None
            if base < 0:
                self._leave_out(bone, "{bone} has no parent to be twisted against")
                return None
            return None if self._spreads_itself(bone) else (bone, base, bone, 1)
        tip = self._tip(bone, is_limb=role == LOWER)
        return None if tip is None or self._spreads_itself(bone) else (bone, bone, tip, 0)

    def _spreads_itself(self, bone: int) -> bool:
        """Whether bendy segments or twist bones spread it already."""
        if self._segments[bone] > 1:
            self._leave_out(bone, "{bone} is a bendy bone, which spreads its roll itself")
            return True
        own = [child for child in self._children[bone] if re.search(OWN_TWIST, self._names[child].lower())]
        if own:
            self._leave_out(bone, "{bone} has twist bones of its own")
        return bool(own)

    def _tip(self, bone: int, is_limb: bool) -> int | None:
        """The child whose twist the bone shares."""
        at_tail = self._starting_at(bone, self._limbs[bone])
        if not is_limb:
            if self._goes_on(self._own[bone], self._limbs[bone]):
                # A bone along its limb says itself where the next of a chain starts.
                at_tail = self._starting_at(bone, self._own[bone])
            straight = [child for child in at_tail if self._goes_on(self._limbs[bone], self._limbs[child])]
            if len(at_tail) == 1 and not straight:
                return None
        ends = [child for child in at_tail if re.search(END, words_of(self._names[child]))]
        if is_limb and len(ends) == 1:
            # Others, as that of a weapon, go with it.
            return ends[0]
        if len(at_tail) > 1:
            self._leave_out(bone, "{bone} carries {count} bones, which may twist apart", len(at_tail))
            return None
        if not at_tail:
            if is_limb:
                self._leave_out(bone, "{bone} carries no deforming bone at its tail")
            return None
        return at_tail[0]

    def _starting_at(self, bone: int, limb: np.ndarray) -> list[int]:
        """Which of those that the bone carries start at the end of a limb, [3] from its head."""
        end, near = self._heads[bone] + limb, NEAR * np.linalg.norm(limb)
        return [child for child in self._children[bone] if np.linalg.norm(self._heads[child] - end) <= near]

    @staticmethod
    def _goes_on(before: np.ndarray, after: np.ndarray) -> bool:
        return bool(before @ after >= STRAIGHT * np.linalg.norm(before) * np.linalg.norm(after))

    def _role(self, bone: int) -> str:
        """UPPER, LOWER or NEITHER by its name, or empty."""
        name = words_of(self._names[bone])
        if re.search(OWN_TWIST, name) or re.match(MADE, name):
            return NEITHER
        for role in (LOWER, UPPER):
            if re.search(role, name):
                return role
        parent = int(self._parents[bone])
        above = self._names[parent].lower().replace("_", "") if parent >= 0 else ""
        if re.search(LEG, name):
            return LOWER if re.search("upleg|upperleg|thigh", above) else NEITHER
        if re.search(ARM, name):
            return UPPER if re.search("shoulder|clavicle|collar", above) else NEITHER
        return NEITHER if re.search(rf"(?<![a-z])({NEITHER})", name) else ""

    def _leave_out(self, bone: int, text: str, count: int = 0) -> None:
        self._left_out.append(phrase(text, bone=self._names[bone], count=count))
