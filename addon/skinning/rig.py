# SPDX-License-Identifier: GPL-3.0-or-later
"""The bones and influences that a mesh is bound to, and warnings about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.phrases import phrase
from .bendy import spread_over_joints
from .bones import RestBones
from .envelopes import fill_from_envelopes, multiply_by_envelopes
from .influences import Entries, Influences
from .limbs import Limbs, find_limbs, skin_of
from .twists import TwistFinder, Twists
from .vectors import SAME_SPACE, transformed

NAMES_SHOWN = 5


@dataclass(frozen=True)
class Bones(RestBones):
    """The same, with what is found of their limbs."""

    @cached_property
    def limbs(self) -> Limbs:
        """Where the limb of each bone goes, which may be across the bone."""
        return find_limbs(self)

    def limb_ends(self, matrices: np.ndarray) -> np.ndarray:
        """float64 [bones, 3]: where the limb of each bone ends, in the space of `matrices`.

        matrices  [bones or more, 4, 4], of the bones at rest or posed
        """
        of_bones = matrices[: len(self.names)].astype(np.float64)
        return of_bones[:, :3, 3] + (of_bones[:, :3, :3] @ self.limbs_in_bones[..., None])[..., 0]

    @cached_property
    def limbs_in_bones(self) -> np.ndarray:
        """float64 [bones, 3]: `limbs` in each bone's own axes: along Y unless it stands across."""
        own = np.linalg.pinv(self.rest[: len(self.names), :3, :3].astype(np.float64))
        return (own @ self.limbs.vectors[..., None])[..., 0]

    @cached_property
    def twists(self) -> Twists:
        """The bones that share the twist of another."""
        return TwistFinder(self, self.limbs).find(self.owners[len(self.names) :])


@dataclass(frozen=True)
class Weighting:
    """A mesh's group entries, from which its influences at given rest points are made.

    entries        of deforming bones
    use_envelopes  vertices without entries are moved by the envelopes that reach them
    """

    bones: Bones
    entries: Entries
    use_envelopes: bool

    @cached_property
    def _multiplies(self) -> bool:
        multiply = self.bones.envelopes.multiply
        return bool(multiply.any() and multiply[self.entries.bones].any())

    @cached_property
    def depends_on_points(self) -> bool:
        return self.bones.bend or self._multiplies or self.use_envelopes

    @cached_property
    def _influences_of_groups(self) -> Influences:
        return self.entries.influences()

    def influences(self, points: np.ndarray) -> Influences:
        """Returns influences of bones, for rest points float [vertices, 3]; in armature space if
        depends_on_points, otherwise in any space."""
        entries, envelopes = self.entries, self.bones.envelopes
        if not self._multiplies and not self.use_envelopes:
            return self._influences_of_groups
        if self._multiplies:
            entries = multiply_by_envelopes(entries, envelopes, points)
        if self.use_envelopes:
            entries = fill_from_envelopes(entries, envelopes, self.bones.deform, points)
        return entries.influences()

    def with_skin(self, points: np.ndarray, space: np.ndarray | None) -> Weighting:
        """Returns the same, whose bones know the skin that they move, where it may tell their limbs.

        points  float [vertices, 3] at rest
        space   [4, 4], from theirs to armature space; None where that has no size
        """
        by_skin = self.bones.limbs.by_skin
        if space is None or not by_skin.any():
            return self
        points = points if space is SAME_SPACE else transformed(points, space)
        skin = skin_of(self.influences(points), points, by_skin)
        return replace(self, bones=replace(self.bones, skin=skin))

    def influences_over_joints(self, points: np.ndarray) -> Influences:
        """Returns influences of bones and of the joints of bendy bones."""
        influences = self.influences(points)
        return spread_over_joints(influences, points, self.bones) if self.bones.bend else influences


@dataclass(frozen=True)
class RigFacts:
    """Facts about a bound mesh, shown by `sinew info` and the panel."""

    vertices: int
    bones: int
    weighted_bones: int
    mean_influences: float
    most_influences: int
    warnings: tuple[str, ...]

    def with_warnings(self, more: list[str]) -> RigFacts:
        return replace(self, warnings=(*self.warnings, *more))


def describe_rig(weighting: Weighting, points: np.ndarray, boneless: Sequence[str]) -> RigFacts:
    """Returns counts and warnings. `weighted_bones` is the number of bones that move at least one vertex.

    points    [vertices, 3], rest points: see Weighting.influences
    boneless  names of groups that belong to no bone and have no other use
    """
    influences, bones = weighting.influences(points), weighting.bones
    counts = influences.counts
    warnings = []
    bare = int((counts == 0).sum())
    if bare:
        text = "{bare} of {count} vertices have no weights and stay at rest"
        warnings.append(phrase(text, bare=bare, count=len(counts)))
    if boneless:
        warnings.append(phrase("Groups without a bone: {names}", names=_shortened(boneless)))
    return RigFacts(
        vertices=len(counts),
        bones=len(bones.names),
        weighted_bones=int(np.count_nonzero(np.bincount(influences.bones))),
        mean_influences=float(counts.mean()) if len(counts) else 0.0,
        most_influences=int(counts.max(initial=0)),
        warnings=tuple(warnings),
    )


def _shortened(names: Sequence[str]) -> str:
    rest = len(names) - NAMES_SHOWN
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {rest} more" if rest > 0 else "")
