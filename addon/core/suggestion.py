# SPDX-License-Identifier: GPL-3.0-or-later
"""Which method is best at what, over some frames. No measure says which shape looks best."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Criterion:
    """What a method can be good at.

    name   for programs
    label  for people
    entry  of a metrics.Summary, or "" for what is counted separately; the nearer to 0 the better
    unit   "share", "length" or "count"
    text   one sentence
    """

    name: str
    label: str
    entry: str
    unit: str
    text: str


CRITERIA = (
    Criterion("stretch", "Stretch", "stretch_rms", "share", "How evenly edges keep their length (RMS)"),
    Criterion("volume", "Volume", "volume_change", "share", "How far the volume is from that at rest"),
    Criterion("bulge", "Bulge", "bulge_worst", "length", "How far a vertex leaves or nears its bone's axis"),
    Criterion("flips", "Flips", "flipped_area", "share", "How much of the surface is folded over"),
    Criterion(
        "crossings", "Crossings", "", "count", "How many triangles cross others that they do not at rest"
    ),
)
# Values that differ by less are equally good: as a share of the best, and absolutely.
SAME_PART = 0.02
SAME = {"share": 1e-4, "length": 1e-4, "count": 0.5}


@dataclass(frozen=True)
class Worst:
    value: float
    frame: float


@dataclass
class Suggestion:
    """The worst values of each method.

    methods   name -> label, in order
    frames    that were measured
    diagonal  of the rest shape: lengths are judged relative to it
    worst     by method and criterion: the largest magnitude over the frames, and its frame; missing for a
              criterion that could not be measured
    """

    methods: Mapping[str, str]
    frames: Sequence[float]
    diagonal: float
    worst: dict[tuple[str, str], Worst] = field(default_factory=dict)

    def add(self, method: str, criterion: str, value: float, frame: float) -> None:
        """Adds a value. NaN, as the volume of a flat mesh, does not count."""
        known = self.worst.get((method, criterion))
        if value == value and (known is None or abs(value) > abs(known.value)):
            self.worst[method, criterion] = Worst(value, frame)

    def best(self, criterion: Criterion) -> list[str]:
        """Returns the methods that are best at it; empty where all are equally good, or it was not
        measured."""
        values = {
            m: abs(self.worst[m, criterion.name].value) for m in self.methods if self._has(m, criterion)
        }
        if not values:
            return []
        least = SAME[criterion.unit] * (self.diagonal if criterion.unit == "length" else 1.0)
        best = min(values.values())
        chosen = [m for m, value in values.items() if value <= best + max(SAME_PART * best, least)]
        return chosen if len(chosen) < len(values) else []

    def order(self, criterion: Criterion) -> list[str]:
        """Returns the methods, the best at it first; those without a value last."""
        worst = {m: self.worst[m, criterion.name].value for m in self.methods if self._has(m, criterion)}
        return sorted(self.methods, key=lambda method: abs(worst.get(method, math.inf)))

    @property
    def text(self) -> str:
        """One sentence about which methods are best at what."""
        best = [
            f"{criterion.label.lower()}: {', '.join(self.methods[method] for method in self.best(criterion))}"
            for criterion in CRITERIA
            if self.best(criterion)
        ]
        return f"Best at {'; '.join(best)}." if best else "All methods are equally good here."

    def _has(self, method: str, criterion: Criterion) -> bool:
        return (method, criterion.name) in self.worst
