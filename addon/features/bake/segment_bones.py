# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain bones in place of bendy bones: the joints of bendy.py, with constant weights.

A vertex is moved by the two joints nearest to it, with shares that depend on its rest point alone. So n + 1
plain bones are an exact replacement under linear blend skinning, unless shape keys move a vertex along the
bone, a joint is sheared, or a vertex has more influences than the file takes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.phrases import Phrase, phrase
from ...skinning.influences import Influences
from ...skinning.rig import Bones


@dataclass(frozen=True)
class SegmentReport:
    """What plain bones leave of the shape, for each cause alone: the largest distance, in scene units.

    bendy       the number of bones that bend in segments
    bones       the number of plain bones in their place
    influences  of a vertex, at most
    method      between the shape shown and linear blending by joints
    sliding     between weights at each frame and constant ones
    shear       between the joints' motions and their location, rotation and scale
    cut         between all influences and the heaviest
    """

    armature: str
    bendy: int
    bones: int
    influences: int
    method: float
    sliding: float
    shear: float
    cut: float

    def sentence(self, unit: str) -> Phrase:
        """unit: the name of a scene unit."""
        return phrase(
            "{name}: {bones} bones for {bendy} bendy ones; these alone are at most {method} {unit} off by "
            "the method, {sliding} by shape keys along them, {shear} by shear, {cut} by the limit of "
            "{influences} influences",
            name=self.armature,
            bones=self.bones,
            bendy=self.bendy,
            unit=unit,
            method=f"{self.method:.2g}",
            sliding=f"{self.sliding:.2g}",
            shear=f"{self.shear:.2g}",
            cut=f"{self.cut:.2g}",
            influences=self.influences,
        )


class SegmentErrors:
    """The distances of a SegmentReport, over frames.

    influences  of bones and joints, constant
    bendy       int [n], the bendy bones whose joints move vertices
    joints      int [n], the joints of these
    most        influences of a vertex that are kept; 0 for all
    """

    def __init__(self, bones: Bones, influences: Influences, most: int) -> None:
        self._most = most or int(influences.counts.max(initial=0))
        self.influences, self._cut = influences, influences.heaviest(self._most)
        used = influences.bones[influences.bones >= len(bones.names)]
        self.bendy = np.unique(bones.owners[used])
        self.joints = len(bones.names) + np.flatnonzero(np.isin(bones.owners[len(bones.names) :], self.bendy))
        self._found = np.zeros(4)

    def take(
        self,
        shown: np.ndarray,
        rest: np.ndarray,
        motions: np.ndarray,
        plain: np.ndarray,
        now: Influences | None = None,
    ) -> None:
        """Adds a frame; all in armature space.

        shown, rest  [vertices, 3]
        motions      float64 [bones + joints, 3 or 4, 4], from rest
        plain        the same, each of a location, rotation and scale
        now          the influences of these rest points, if they differ
        """
        constant = self.influences.blended(motions, rest)
        exact = constant if now is None else now.blended(motions, rest)
        pairs = (
            (shown, exact),
            (exact, constant),
            (self.influences.blended(plain, rest), constant),
            (self._cut.blended(motions, rest), constant),
        )
        apart = [np.linalg.norm(a - b, axis=1).max(initial=0.0) for a, b in pairs]
        self._found = np.maximum(self._found, apart)

    def report(self, armature: str, unit: float) -> SegmentReport:
        """unit: of armature space, in scene units."""
        found = (float(unit * distance) for distance in self._found)
        return SegmentReport(armature, len(self.bendy), len(self.joints), self._most, *found)
