# SPDX-License-Identifier: GPL-3.0-or-later
"""Which method is best at what, over some frames."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from ...base.phrases import Phrase, phrase


@dataclass(frozen=True)
class Criterion:
    """What a method can be good at.

    name    for programs
    label   for people
    entry   of a metrics.Summary, or "" for what is counted separately; the nearer to 0 the better
    unit    "share", "length" or "count"
    praise  what the best method does
    worse   what another does, so many times as the chosen one
    text    one sentence
    """

    name: str
    label: str
    entry: str
    unit: str
    praise: str
    worse: str
    text: str


CRITERIA = (
    Criterion(
        "stretch",
        "Stretch",
        "stretch_rms",
        "share",
        "stretches least",
        "{method} stretches {times:.2g} times as much",
        "How evenly edges keep their length (RMS)",
    ),
    Criterion(
        "volume",
        "Volume",
        "limb_change",
        "share",
        "keeps volume best",
        "{method} changes volume {times:.2g} times as much",
        "How much volume the limbs lose or gain, each by itself",
    ),
    Criterion(
        "bulge",
        "Bulge",
        "bulge_worst",
        "length",
        "bulges least",
        "{method} bulges {times:.2g} times as far",
        "How far a vertex leaves or nears its bone's axis",
    ),
    Criterion(
        "flips",
        "Flips",
        "flipped_area",
        "share",
        "folds over least",
        "{method} folds over {times:.2g} times as much",
        "How much of the surface is folded over",
    ),
    Criterion(
        "crossings",
        "Intersections",
        "",
        "count",
        "intersects itself least",
        "{method} intersects itself {times:.2g} times as often",
        "How many triangles go through others that they do not at rest",
    ),
)
# Where it does nothing worse.
ALIKE = (1.0, "{method} is as good by these measures")
LONGEST = "longest"
"""The longest edge, as a part of its length at rest, by which torn shapes are found."""
MEASURED = {**{c.name: c.entry for c in CRITERIA if c.entry}, LONGEST: "stretch_max"}
"""Entries of a metrics.Summary, by the names in Suggestion.worst."""
# Values that differ by less are equally good: as a share of the best, and absolutely.
SAME_PART = 0.02
SAME = {"share": 1e-4, "length": 1e-4, "count": 0.5}


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
    "bulge": Tear(3.0, 5e-3, "length", "it bulges {beside:.3g} times as far"),
}


@dataclass(frozen=True)
class Worst:
    value: float
    frame: float


@dataclass
class Suggestion:
    """The worst values of each method, and what follows from them, once all are added.

    methods   name -> label, in order
    frames    that were measured
    diagonal  of the rest shape: lengths are judged relative to it
    worst     by method and criterion: the largest magnitude over the frames, and its frame; missing for a
              criterion that could not be measured
    """

    methods: dict[str, str]
    frames: Sequence[float]
    diagonal: float
    worst: dict[tuple[str, str], Worst] = field(default_factory=dict)

    def add(self, method: str, criterion: str, value: float, frame: float) -> None:
        """Adds a value. NaN, as the volume of a flat mesh, does not count."""
        known = self.worst.get((method, criterion))
        if value == value and (known is None or abs(value) > abs(known.value)):
            self.worst[method, criterion] = Worst(value, frame)

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

    def order(self, criterion: Criterion) -> list[str]:
        """Returns the methods, the best at it first; then those that are torn; those without a value last."""
        known = self._magnitudes(criterion.name)
        return sorted(self.methods, key=lambda m: (m not in known, m in self.torn, known.get(m, 0.0)))

    def why_not(self, method: str, chosen: str) -> Phrase:
        """Returns why a method that is best at something was not chosen: what it does worst, against what
        was."""
        worst = ALIKE
        for criterion in CRITERIA:
            known = self._magnitudes(criterion.name)
            if method in known and chosen in known:
                least = self._scaled(SAME[criterion.unit], criterion.unit)
                times = (known[method] + least) / (known[chosen] + least)
                worst = max(worst, (times, criterion.worse))
        return phrase(worst[1], method=phrase(self.methods[method]), times=worst[0])

    @property
    def text(self) -> str:
        """One sentence: what each method is best at."""
        said = []
        for method, label in self.methods.items():
            praises = [criterion.praise for criterion in CRITERIA if method in self.best(criterion)]
            said += [f"{label} {' and '.join(praises)}"] if praises else []
        return "; ".join(said) or "All methods are equally good here"

    def _magnitudes(self, name: str) -> dict[str, float]:
        """The worst values by method, without their signs."""
        return {m: abs(self.worst[m, name].value) for m in self.methods if (m, name) in self.worst}

    def _values(self, criterion: Criterion) -> dict[str, float]:
        """The same of the methods that are not torn."""
        return {m: value for m, value in self._magnitudes(criterion.name).items() if m not in self.torn}

    def _scaled(self, value: float, unit: str) -> float:
        return value * (self.diagonal if unit == "length" else 1.0)
