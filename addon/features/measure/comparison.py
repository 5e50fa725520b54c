# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of a comparison of methods: measures of each frame, worst frames, diagnostics; as JSON."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Self

from .diagnostics import Finding
from .metrics import METRICS, Gauge, Summary

# Compared unless the user names others.
USUAL_METHODS = ("lbs", "dq", "cor")
# Differences below this share of the diagonal, or of the value at rest, are rounding errors.
ROUNDING = 1e-5
LENGTHS = {"distance_max", "distance_rms", "bulge_min", "bulge_max", "bulge_worst"}


@dataclass(frozen=True)
class RestFacts:
    """Facts about the rest shape of all meshes together."""

    vertices: int
    triangles: int
    diagonal: float
    volume: float
    area: float
    holes: int
    clashes: int

    @classmethod
    def of(cls, gauge: Gauge) -> Self:
        """Returns the facts at the frame last set in `gauge`."""
        surface, rest = gauge.surface, gauge.rest
        return cls(
            surface.vertex_count,
            len(surface.triangles),
            rest.diagonal,
            rest.volume,
            rest.area,
            surface.caps.count,
            surface.clash_count,
        )

    @property
    def note(self) -> str:
        """Returns one sentence about how reliable the volume is; empty for a closed mesh."""
        if self.clashes:
            return (
                f"{self.clashes:,} edges have faces that wind against each other, or more than two: the "
                "volume means little; recalculate the normals (Mesh > Normals > Recalculate Outside)."
            )
        if self.holes:
            return (
                f"The mesh has {self.holes:,} hole{'s' if self.holes > 1 else ''}: the volume is that with "
                "each closed by a fan to the middle of its border."
            )
        return ""


@dataclass(frozen=True)
class Worst:
    """The frame and method at which a measure has its largest value."""

    measure: str
    frame: float
    method: str
    value: float


@dataclass
class Comparison:
    """Several methods compared on the meshes of one file.

    methods    name -> label, in order
    reference  the method that distances are measured from
    unit       of lengths
    summaries  by method, for each frame
    times      by method, for each frame: the milliseconds that Blender took for the whole frame
    own        by method, for each frame: the milliseconds of this that Sinew took
    findings   by mesh
    """

    file: str
    meshes: list[str]
    methods: dict[str, str]
    reference: str
    unit: str
    rest: RestFacts
    frames: list[float]
    summaries: dict[str, list[Summary]]
    times: dict[str, list[float]]
    own: dict[str, list[float]]
    findings: dict[str, list[Finding]]

    def values(self, method: str, entry: str) -> list[float]:
        """One entry of the summaries, for each frame."""
        return [getattr(summary, entry) for summary in self.summaries[method]]

    def length(self, value: float) -> str:
        """The length as text with its unit; 0 for a rounding error."""
        return f"{value if abs(value) > ROUNDING * self.rest.diagonal else 0.0:.3g}\u00a0{self.unit}"

    def shows(self, entry: str, value: float) -> bool:
        """Whether an entry of the summaries is more than a rounding error."""
        return abs(value) > ROUNDING * (self.rest.diagonal if entry in LENGTHS else 1.0)

    def worst(self, entry: str) -> Worst:
        """Returns where an entry of the summaries has its largest magnitude; the first of equals."""
        candidates = [
            Worst(entry, frame, method, value)
            for method in self.methods
            for frame, value in zip(self.frames, self.values(method, entry), strict=True)
            if value == value
        ]
        nothing = Worst(entry, self.frames[0], next(iter(self.methods)), 0.0)
        return max(candidates, key=lambda worst: abs(worst.value), default=nothing)

    def worst_frames(self, count: int) -> list[float]:
        """Returns at most `count` frames, in order: the worst frame of each measure, without those close to
        one that is already chosen."""
        entries = ["distance_max", "volume_change", *(metric.worst for metric in METRICS.values())]
        apart = (max(self.frames) - min(self.frames)) / 10
        chosen: list[float] = []
        for worst in map(self.worst, entries):
            is_new = all(abs(worst.frame - frame) > apart for frame in chosen)
            if is_new and len(chosen) < count and self.shows(worst.measure, worst.value):
                chosen.append(worst.frame)
        return sorted(chosen) or self.frames[:1]

    def to_json(self) -> str:
        """Returns everything, including the vertices of the findings."""
        return json.dumps(
            {
                "file": self.file,
                "meshes": self.meshes,
                "methods": self.methods,
                "reference": self.reference,
                "unit": self.unit,
                "rest": asdict(self.rest),
                "frames": self.frames,
                "summaries": {
                    method: [_finite(asdict(summary)) for summary in summaries]
                    for method, summaries in self.summaries.items()
                },
                "milliseconds": self.times,
                "milliseconds_of_sinew": self.own,
                "findings": {
                    mesh: [finding.to_dict() for finding in findings]
                    for mesh, findings in self.findings.items()
                },
            },
            indent=1,
            ensure_ascii=False,
            allow_nan=False,
        )


def peaks(values: Sequence[float], count: int) -> list[int]:
    """Returns the indices of at most `count` local maxima of `values`, largest first; the first of equal
    neighbours. Frames next to the worst one show the same, so only maxima count."""
    padded = [-math.inf, *values, -math.inf]
    indices = [i for i, value in enumerate(values) if padded[i] < value and value >= padded[i + 2]]
    return sorted(indices, key=lambda i: -values[i])[:count]


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    """Replaces NaN and infinity by None, as JSON has neither."""
    return {name: value if math.isfinite(value) else None for name, value in values.items()}
