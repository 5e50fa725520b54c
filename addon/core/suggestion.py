# SPDX-License-Identifier: GPL-3.0-or-later
"""Which method suits a character, over some frames, and which is best at what."""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from .phrases import Phrase, phrase


@dataclass(frozen=True)
class Criterion:
    """What a method can be good at.

    name    for programs
    label   for people
    entry   of a metrics.Summary, or "" for what is counted separately; the nearer to 0 the better
    unit    "share", "length" or "count"
    weight  in the choice of the recommended method: what the eye sees first counts most
    praise  what the best method does
    text    one sentence
    """

    name: str
    label: str
    entry: str
    unit: str
    weight: float
    praise: str
    text: str


CRITERIA = (
    Criterion(
        "stretch",
        "Stretch",
        "stretch_rms",
        "share",
        0.5,
        "stretches least",
        "How evenly edges keep their length (RMS)",
    ),
    Criterion(
        "volume",
        "Volume",
        "limb_change",
        "share",
        2.0,
        "keeps volume best",
        "How much volume the limbs lose or gain, each by itself",
    ),
    Criterion(
        "bulge",
        "Bulge",
        "bulge_worst",
        "length",
        2.0,
        "bulges least",
        "How far a vertex leaves or nears its bone's axis",
    ),
    Criterion(
        "flips",
        "Flips",
        "flipped_area",
        "share",
        1.0,
        "folds over least",
        "How much of the surface is folded over",
    ),
    Criterion(
        "crossings",
        "Crossings",
        "",
        "count",
        1.0,
        "crosses itself least",
        "How many triangles cross others that they do not at rest",
    ),
)
# Scores that differ by less are equal: the first method that is best at something is recommended.
AS_GOOD = 0.2
LONGEST = "longest"
"""The longest edge, as a part of its length at rest, by which torn shapes are found."""
MEASURED = {**{c.name: c.entry for c in CRITERIA if c.entry}, LONGEST: "stretch_max"}
"""Entries of a metrics.Summary, by the names in Suggestion.worst."""
# Values that differ by less are equally good: as a share of the best, and absolutely.
SAME_PART = 0.02
SAME = {"share": 1e-4, "length": 1e-4, "count": 0.5}
# Smaller values are hardly seen, so they count little in the choice of the recommended method.
SEEN = {"share": 1e-2, "length": 5e-3, "count": 20.0}


@dataclass(frozen=True)
class Tear:
    """By what a method is torn.

    times  its worst value is more than so many times the median of all
    least  and at least this, of the unit
    text   one sentence, with the value, and how many times the median it is
    """

    times: float
    least: float
    unit: str
    text: str


TEARS = {
    LONGEST: Tear(2.0, 2.0, "share", "an edge has {value:.3g} times its length"),
    "bulge": Tear(3.0, SEEN["length"], "length", "it bulges {beside:.3g} times as far"),
}


@dataclass(frozen=True)
class Worst:
    value: float
    frame: float


@dataclass
class Suggestion:
    """The worst values of each method, and what follows from them, once all are added.

    methods   name -> label, in order; stages among them stand for the recommended method with the stage
    frames    that were measured
    diagonal  of the rest shape: lengths are judged relative to it
    worst     by method and criterion: the largest magnitude over the frames, and its frame; missing for a
              criterion that could not be measured
    helping   the stages that make the recommended method better, each with what it does
    """

    methods: dict[str, str]
    frames: Sequence[float]
    diagonal: float
    worst: dict[tuple[str, str], Worst] = field(default_factory=dict)
    helping: dict[str, Phrase] = field(default_factory=dict)

    def add(self, method: str, criterion: str, value: float, frame: float) -> None:
        """Adds a value. NaN, as the volume of a flat mesh, does not count."""
        known = self.worst.get((method, criterion))
        if value == value and (known is None or abs(value) > abs(known.value)):
            self.worst[method, criterion] = Worst(value, frame)

    def add_stages(self, labels: Mapping[str, str]) -> None:
        """Adds stages. What is recommended, and why, is said of methods alone."""
        self.methods |= labels if self.recommended and self.reason else {}
        vars(self).pop("torn", None)

    @cached_property
    def torn(self) -> dict[str, Phrase]:
        """The methods that are far from the others, each with the reason: they are best at nothing."""
        found: dict[str, Phrase] = {}
        for name, tear in TEARS.items():
            values, least = self._magnitudes(name), self._scaled(tear.least, tear.unit)
            usual = statistics.median(values.values()) if len(values) > 2 else math.inf
            for method, value in values.items():
                if value > tear.times * usual and value >= least:
                    text = tear.text if math.isfinite(value) else "its shape is not finite"
                    found.setdefault(method, phrase(text, value=value, beside=value / max(usual, least)))
        return found if len(found) < len(self.methods) else {}

    def best(self, criterion: Criterion) -> list[str]:
        """Returns the methods that are best at it; empty where all are equally good, or it was not
        measured."""
        values = self._values(criterion)
        if not values:
            return []
        best = min(values.values())
        most = best + max(SAME_PART * best, self._scaled(SAME[criterion.unit], criterion.unit))
        chosen = [method for method, value in values.items() if value <= most]
        return chosen if len(chosen) < len(values) else []

    @cached_property
    def recommended(self) -> str:
        """The method whose values are smallest beside the medians of those that are not torn; empty where all
        are equally good."""
        scores = dict.fromkeys(self.methods, 0.0)
        for criterion in CRITERIA:
            values, least = self._values(criterion), self._scaled(SEEN[criterion.unit], criterion.unit)
            usual = statistics.median(values.values()) if values else 0.0
            for method, value in values.items():
                scores[method] += criterion.weight * math.log((value + least) / (usual + least))
        for method in self.torn:
            del scores[method]
        if not any(self.best(criterion) for criterion in CRITERIA):
            return ""
        least = min(scores.values())
        as_good = [method for method, score in scores.items() if score <= least + AS_GOOD]
        best = {method for criterion in CRITERIA for method in self.best(criterion)}
        return next((method for method in as_good if method in best), as_good[0])

    @cached_property
    def reason(self) -> Phrase:
        """Why the recommended method is, in its two strongest points."""
        best_at = [criterion for criterion in CRITERIA if self.recommended in self.best(criterion)]
        best_at.sort(key=lambda criterion: -criterion.weight)
        praises = [phrase(criterion.praise) for criterion in best_at] or [phrase("is good at all measures")]
        if len(praises) == 1:
            return praises[0]
        return phrase("{first} and {second}", first=praises[0], second=praises[1])

    def order(self, criterion: Criterion) -> list[str]:
        """Returns the methods, the best at it first; then those that are torn; those without a value last."""
        known = self._magnitudes(criterion.name)
        return sorted(self.methods, key=lambda m: (m not in known, m in self.torn, known.get(m, 0.0)))

    @property
    def text(self) -> Phrase:
        """One sentence: the recommended method and why."""
        if not self.recommended:
            return phrase("All methods are equally good here")
        text = phrase("{method}: {why}", method=phrase(self.methods[self.recommended]), why=self.reason)
        for stage, why in self.helping.items():
            helps = phrase("with {stage} {why}", stage=phrase(self.methods[stage]), why=why)
            text = phrase("{first}; {second}", first=text, second=helps)
        return text

    def _magnitudes(self, name: str) -> dict[str, float]:
        """The worst values by method, without their signs."""
        return {m: abs(self.worst[m, name].value) for m in self.methods if (m, name) in self.worst}

    def _values(self, criterion: Criterion) -> dict[str, float]:
        """The same of the methods that are not torn."""
        return {m: value for m, value in self._magnitudes(criterion.name).items() if m not in self.torn}

    def _scaled(self, value: float, unit: str) -> float:
        return value * (self.diagonal if unit == "length" else 1.0)
