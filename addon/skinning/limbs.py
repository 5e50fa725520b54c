# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the limb of each bone goes: files from other programs bring bones that stand across it."""

from __future__ import annotations

import re
from math import sqrt
from typing import NamedTuple

import numpy as np

from ..base.names import MADE_BONES
from .bones import RestBones
from .influences import Influences

# Words of bones' names, in the common rigs: Rigify, Mixamo, Unreal, MakeHuman, MikuMikuDance.
UPPER = r"upper_?arm|up_?arm|thigh|up_?leg|upper_?leg|femur|humerus"
LOWER = r"fore_?arm|lower_?arm|low_?arm|shin|calf|lower_?leg|low_?leg|radius|ulna|tibia"
NEITHER = (
    r"shoulder|clavicle|collar|hand|wrist|foot|ankle|toe|heel|ball|thumb|index|middle|ring|pinky|little|finger|"
    r"metacarpal|palm|pelvis|hips?|head|eye|jaw|tongue|root|breast"
)
# What a lower limb ends in.
END = r"(?<![a-z])(hand|wrist|foot|ankle)(?![a-z])"
OWN_TWIST = r"twist|roll"
# Mixamo has Arm above ForeArm and UpLeg above Leg.
ARM, LEG = r"(?<![a-z])arm(?![a-z])", r"(?<![a-z])leg(?![a-z])"
# Bones that Sinew makes, named as the limbs that they follow.
MADE = rf"({'|'.join(MADE_BONES).lower()})_"
# A bone starts at the end of a limb within so many of the limb's lengths.
NEAR = 0.25
# Without names, a chain goes on where the next bone points on within 45 degrees; a bone farther from its limb
# stands across it.
STRAIGHT = np.cos(np.radians(45.0))
# The cosine of 15 degrees: rigs of other programs have all bones of a chain stand alike to their limbs.
ALIKE = np.cos(np.radians(15.0))
# Skin whose middle is nearer to the head than so much of its spread is around it, and tells no direction.
AROUND = 0.5


def _length(vector: np.ndarray) -> float:
    """That of one vector, in a fifth of the time of numpy's."""
    return sqrt(vector @ vector)


def words_of(name: str) -> str:
    """Returns a bone's name in lower case, its words divided."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


def skin_of(influences: Influences, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Returns float64 [bones, 5], sums over the vertices that each bone moves, by weight: of their points, of
    the squares of these, of 1. Those of several meshes may be added. 0 for bones that are not wanted.

    points  [vertices, 3], armature space
    wanted  bool [bones]
    """
    taken = np.flatnonzero(wanted[influences.bones])
    bones, weights = influences.bones[taken], influences.weights[taken]
    points = points[np.searchsorted(influences.offsets, taken, side="right") - 1].astype(np.float64)
    values = np.column_stack([points, (points * points).sum(axis=1), np.ones(len(points))])
    sums = [np.bincount(bones, weights * each, len(wanted)) for each in values.T]
    return np.stack(sums, axis=1)


class Limbs(NamedTuple):
    """
    vectors  float64 [bones, 3], from the head of each bone to the end of its limb, at rest, armature space
    known    bool [bones]: False where nothing tells it, and what carries the bone stands across its own limb
    by_skin  bool [bones]: whether the skin that the bone moves may tell it, whatever that is
    """

    vectors: np.ndarray
    known: np.ndarray
    by_skin: np.ndarray


def find_limbs(bones: RestBones) -> Limbs:
    """The limb of a bone ends at the joint that the bone carries. Without one, it is the bone itself, where
    what carries the bone is along its limb. Else it is as those of what carries it, in the bones' own axes,
    where these are alike; or it goes to the middle of the skin that the bone moves, and as far beyond."""
    return _Finder(bones).find()


class _Finder:
    def __init__(self, bones: RestBones) -> None:
        self._bones = bones
        rest = bones.rest[: len(bones.names)].astype(np.float64)
        self._axes, self._heads = rest[:, :3, :3], rest[:, :3, 3]
        self._own = bones.lengths[:, None] * self._axes[:, :, 1]
        self._joints = [self._to_joint(bone) for bone in range(len(bones.names))]

    def find(self) -> Limbs:
        count = len(self._own)
        limbs = Limbs(self._own.copy(), np.ones(count, bool), np.zeros(count, bool))
        # Whether each stands across its limb, or the nearest above whose joint tells it.
        stands_across: dict[int, bool] = {}
        for bone in self._bones.from_the_root:
            joint, above = self._joints[bone], int(self._bones.deforming_parents[bone])
            is_across = stands_across.get(above, False) if above >= 0 else self._are_most_across(bone)
            if joint is not None and (is_across or not self._is_no_limb(bone)):
                limbs.vectors[bone] = joint
                is_across = self._is_across(bone, joint)
            elif is_across:
                self._set_end(limbs, bone)
            stands_across[bone] = is_across
        return limbs

    def _to_joint(self, bone: int) -> np.ndarray | None:
        own, name, joints = self._own[bone], words_of(self._bones.names[bone]), []
        size = _length(own)
        for child in self._bones.children[bone]:
            of_child, way = words_of(self._bones.names[child]), self._heads[child] - self._heads[bone]
            is_helper = re.search(OWN_TWIST, of_child) or re.match(MADE, of_child)
            if not is_helper and _length(way) > 1e-3 * size:
                joints.append(way)
        nearest = min(joints, key=lambda joint: _length(joint - own), default=None)
        if nearest is None or _length(nearest - own) <= NEAR * size or len(joints) == 1:
            return nearest
        # Others, as of muscles, start on the way.
        is_limb = re.search(f"{UPPER}|{LOWER}|{ARM}|{LEG}", name)
        return max(joints, key=lambda joint: _length(joint)) if is_limb else None

    def _is_no_limb(self, bone: int) -> bool:
        """Whether what it carries elsewhere than at its tail need not be its end, as the jaw of a head."""
        joint, own = self._joints[bone], self._own[bone]
        is_elsewhere = joint is not None and _length(joint - own) > NEAR * _length(own)
        return bool(is_elsewhere and re.search(rf"(?<![a-z])({NEITHER})", words_of(self._bones.names[bone])))

    def _are_most_across(self, bone: int) -> bool:
        """Of those that a bone carries that nothing carries."""
        told = [
            (child, joint)
            for child in self._bones.children[bone]
            if (joint := self._joints[child]) is not None
        ]
        return sum(self._is_across(*each) for each in told) > len(told) / 2

    def _set_end(self, limbs: Limbs, bone: int) -> None:
        skin, alike = self._to_skin(bone), [self._as(other, bone) for other in self._told_around(bone)]
        limbs.known[bone], limbs.by_skin[bone] = skin is not None, True
        if alike and (skin is None or (len(alike) > 1 and alike[0] @ alike[1] >= ALIKE)):
            limbs.vectors[bone] = self._bones.lengths[bone] * alike[0]
        elif skin is not None:
            limbs.vectors[bone] = skin

    def _told_around(self, bone: int) -> list[int]:
        """Those whose joints tell their limbs: of the bones that carry it, the nearest first; of one that
        nothing carries, of those that it carries."""
        found, above = [], int(self._bones.deforming_parents[bone])
        if above < 0:
            return [child for child in self._bones.children[bone] if self._joints[child] is not None]
        while above >= 0 and above not in found:
            found.append(above)
            above = int(self._bones.deforming_parents[above])
        return [other for other in found if self._joints[other] is not None]

    def _as(self, other: int, bone: int) -> np.ndarray:
        """The direction of a bone's limb if the bone stands to it as another does to its own."""
        way = self._axes[bone] @ np.linalg.pinv(self._axes[other]) @ self._joints[other]
        return way / _length(way)

    def _to_skin(self, bone: int) -> np.ndarray | None:
        """From the bone's head through the middle of its skin to the end."""
        skin = self._bones.skin
        if skin is None or not skin[bone, 4] > 0.0:
            return None
        *middle, square = skin[bone, :4] / skin[bone, 4]
        way = np.array(middle) - self._heads[bone]
        spread = np.sqrt(max(square - np.square(middle).sum(), 0.0))
        return 2.0 * way if _length(way) > AROUND * spread else None

    def _is_across(self, bone: int, limb: np.ndarray) -> bool:
        own = self._own[bone]
        return bool(own @ limb < STRAIGHT * _length(own) * _length(limb))
