# SPDX-License-Identifier: GPL-3.0-or-later
"""The preset Recommended: which method and stages suit a character.

A short row of candidates, each measured in the same moments: first methods, the plainest first, then stages.
A candidate takes the place of what was best before it where it is clearly better in the moments that it
changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...base.phrases import Phrase, phrase
from ...skinning.parameters import Value
from ...skinning.variants import Variant
from ..measure.metrics import Measured
from ..measure.suggestion import LONGEST, TEARS

Values = Mapping[str, np.ndarray]
"""By the names of MEASURES, float64 [bones] of each limb; LONGEST of all, [1]."""


@dataclass(frozen=True)
class Candidate:
    """What may be kept.

    name   of a method or of a stage
    gain   how much better it has to be: the logarithm of a value that sums up all measures
    why    what it does where it is kept
    often  in which share of the moments it has to be better
    """

    name: str
    gain: float
    why: str
    often: float = 0.0


METHODS = (
    Candidate("lbs", 0.0, "the plain blend is as good as any here"),
    Candidate("dq", 0.1, "joints keep their volume"),
    Candidate("cor", 0.05, "joints keep their volume and bulge less"),
)
STAGES = (
    Candidate("twist_spread", 0.05, "twists spread along the limbs"),
    Candidate("bulge_limit", 0.05, "bent joints bulge less"),
    Candidate("delta_mush", 0.2, "creases are smoothed", often=0.25),
)


class Measure(NamedTuple):
    """weight  in the sum of logarithms
    seen    smaller values are hardly seen, so they count little; of a bulge as a part of the mesh's diagonal
    """

    weight: float
    seen: float


MEASURES = {
    "stretch": Measure(1.0, 0.05),
    "volume": Measure(2.0, 0.03),
    "folded": Measure(1.0, 0.02),
    "bulge": Measure(2.0, 0.005),
    "pinch": Measure(2.0, 0.1),
    "crease": Measure(1.0, 0.3),
    "crossings": Measure(1.0, 20.0),
}
"""Of a limb: those of metrics.Measured.by_limb(), and how many of its triangles cross others."""
# Values whose logarithms differ by less are the same.
SAME = 0.01


@dataclass(frozen=True)
class Choice:
    """why: a sentence for the method and for each stage; empty where nothing bends"""

    variant: Variant
    why: tuple[Phrase, ...] = ()

    @property
    def values(self) -> dict[str, Value]:
        """Of every stage, by full names. The method keeps its parameters, with which it was measured."""
        own, values = f"{self.variant.method}.", self.variant.all_values
        return {name: value for name, value in values.items() if not name.startswith(own)}

    @property
    def text(self) -> Phrase:
        """One sentence."""
        text = self.why[0] if self.why else phrase("nothing bends here")
        for each in self.why[1:]:
            text = phrase("{first}; {second}", first=text, second=each)
        return phrase("{method}: {why}", method=self.variant.label, why=text)


def search(
    measure: Callable[[Variant, int], Values],
    moments: Sequence[tuple[str, np.ndarray]],
    diagonal: float,
) -> Generator[float, None, Choice]:
    """Yields the progress; returns the choice.

    measure   the values of a variant in a moment, as from values_of()
    moments   names, for people, with the weights of the limbs
    diagonal  of the rest shape
    """
    candidates = (*METHODS, *STAGES)
    best, whys = Variant.of(METHODS[0].name), {"": phrase(METHODS[0].why)}
    known: list[Values] = []
    done, of_all = 0, len(candidates) * len(moments)
    for candidate in candidates:
        is_method = candidate in METHODS
        tried = replace(best, method=candidate.name) if is_method else best
        if not is_method:
            tried = replace(best, stages=(*best.stages, candidate.name))
        values = []
        for moment in range(len(moments)):
            values.append(measure(tried, moment))
            done += 1
            yield done / of_all
        gains = [
            gain(before, after, diagonal, weights)
            for before, after, (_name, weights) in zip(known, values, moments, strict=False)
        ]
        if not known:
            known = values
        elif _is_kept(candidate, gains):
            best, known = tried, values
            name = moments[gains.index(max(gains))][0]
            place = name if isinstance(name, Phrase) else phrase(name)
            why = phrase("{why} (most: {place})", why=phrase(candidate.why), place=place)
            whys["" if is_method else candidate.name] = why
    return Choice(best, tuple(whys.values()) if moments else ())


def _is_kept(candidate: Candidate, gains: Sequence[float]) -> bool:
    """Whether the candidate is better, by its gains in all moments."""
    changed = [each for each in gains if abs(each) > SAME]
    better = sum(each > SAME for each in gains)
    return (
        better > 0
        and better >= candidate.often * len(gains)
        and sum(changed) / len(changed) >= candidate.gain
    )


def gain(before: Values, after: Values, diagonal: float, weights: np.ndarray) -> float:
    """How much better the second values are, in the mean over the limbs that differ; minus infinity where
    they are those of a torn shape.

    weights  float64 [bones], of the limbs
    """
    tear, longest = TEARS[LONGEST], after[LONGEST].max()
    if not math.isfinite(longest) or longest > max(tear.least, tear.times * before[LONGEST].max()):
        return -math.inf
    gains = np.zeros(len(weights))
    for name, measure in MEASURES.items():
        if name in before:
            least = measure.seen * (diagonal if name == "bulge" else 1.0)
            gain_of_limbs = np.log((before[name] + least) / (after[name] + least))
            gains += measure.weight * np.nan_to_num(gain_of_limbs)
    counts = weights * (np.abs(gains) > SAME)
    return float((counts * gains).sum() / max(counts.sum(), 1e-30))


def values_of(measured: Measured, crossing: np.ndarray | None) -> Values:
    """Returns what gain() compares.

    crossing  int, the triangles that cross others, each as often as it does; None: they were not counted
    """
    longest = measured.entry("stretch_max") if np.isfinite(measured.shape.points).all() else math.inf
    if not math.isfinite(longest):
        return {LONGEST: np.array([math.inf])}
    found = measured.by_limb()
    found[LONGEST] = np.array([longest])
    if crossing is not None:
        limbs = measured.pose.skin.limb_of_triangles[crossing]
        found["crossings"] = np.bincount(limbs[limbs >= 0], minlength=measured.pose.bone_count)
    return found
