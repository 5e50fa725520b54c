# SPDX-License-Identifier: GPL-3.0-or-later
"""Values as colours: the range that is shown, a perceptually uniform colour map, the legend's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from .metrics import Metric, Summary

# Every fifth colour of viridis (S. van der Walt, N. Smith, 2015; CC0), sRGB.
_VIRIDIS = bytes.fromhex(
    "44015446085c471063481769481d6f482475472a7a46307e453781433d844142873f48893d4e8a3a538b38598c355e8d"
    "33638d31688e2e6d8e2c718e2a768e297b8e27808e25848e23898e218e8d20928c1f978b1e9c891fa18821a58524aa83"
    "28ae802eb37c35b7793dbc7446c06f50c46a5ac86465cb5e70cf577cd25089d54895d840a2da37b0dd2fbddf26cae11f"
    "d8e219e5e419f1e51dfde725"
)
# Ratios beyond this many doublings or halvings share the last colour.
MOST_DOUBLINGS = 2.0
LEAST_DOUBLINGS = 0.1
# Lengths of one method beyond this many times those of all others do so, too.
BEYOND_OTHERS = 2.0


def viridis(shares: np.ndarray) -> np.ndarray:
    """float64 [n, 3], sRGB in 0..1: dark violet at 0, green at 0.5, yellow at 1; clipped outside."""
    stops = np.frombuffer(_VIRIDIS, dtype=np.uint8).reshape(-1, 3) / 255.0
    places = np.clip(shares, 0.0, 1.0) * (len(stops) - 1)
    first = np.minimum(places.astype(np.intp), len(stops) - 2)
    steps = np.diff(stops, axis=0)
    return stops.take(first, axis=0) + (places - first)[..., None] * steps.take(first, axis=0)


# Finer than 8 bits show.
_STEPS = 1024


@cache
def _linear_viridis() -> np.ndarray:
    return linear(viridis(np.linspace(0.0, 1.0, _STEPS))).astype(np.float32)


def linear(colours: np.ndarray) -> np.ndarray:
    """Scene-linear colours, as Blender stores them, of sRGB in 0..1."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True)
class HeatScale:
    """Which values the colours stand for: `low` the first, `high` the last.

    clipped  there are values beyond, which share the first or last colour
    """

    metric: Metric
    low: float
    high: float
    clipped: bool = False

    @classmethod
    def over(cls, metric: Metric, methods: Sequence[Sequence[Summary]], diagonal: float) -> HeatScale:
        """Wide enough for the shapes summed up: those of one frame, or of all, so that colours compare.

        methods   for each method its summaries; one that tears the mesh apart does not make all others pale
        diagonal  of the rest shape: differences below a ten thousandth of it are not blown up
        """
        return cls._up_to(metric, [_largest(metric, summaries) for summaries in methods], diagonal)

    @classmethod
    def over_values(cls, metric: Metric, least: float, most: float, diagonal: float) -> HeatScale:
        """The same for values from `least` to `most`."""
        return cls._up_to(metric, [_magnitude(metric, [least, most])], diagonal)

    @classmethod
    def fixed(cls, metric: Metric, end: float, least: float, most: float) -> HeatScale:
        """That ends at a length, or at a ratio above 1, for values from `least` to `most`."""
        beyond = _magnitude(metric, [least, most])
        return cls._to(metric, end, beyond > (np.log2(end) if metric.scale == "log" else end))

    @classmethod
    def _to(cls, metric: Metric, end: float, clipped: bool) -> HeatScale:
        if metric.unit == "share":
            return cls(metric, 0.0, 1.0)
        low = {"linear": 0.0, "signed": -end, "log": 1.0 / end}[metric.scale]
        return cls(metric, low, end, bool(clipped))

    @classmethod
    def _up_to(cls, metric: Metric, largest: Sequence[float], diagonal: float) -> HeatScale:
        """largest  the largest magnitude of each method"""
        largest = sorted(largest, reverse=True)
        beyond = max(largest, default=0.0)
        if metric.scale == "log":
            factor = 2.0 ** float(np.clip(beyond, LEAST_DOUBLINGS, MOST_DOUBLINGS))
            return cls._to(metric, factor, beyond > MOST_DOUBLINGS)
        least = max(1e-4 * diagonal, 1e-12)
        most = beyond
        if len(largest) > 1 and largest[1] > least:
            most = min(most, BEYOND_OTHERS * largest[1])
        end = max(most, least)
        return cls._to(metric, end, beyond > end)

    def colours(self, values: np.ndarray) -> np.ndarray:
        """float64 [n, 3], sRGB in 0..1."""
        return viridis(self._shares(values))

    def linear_colours(self, values: np.ndarray) -> np.ndarray:
        """float32 [n, 3], the same scene-linear, to 0.002: from a table, for it is asked for every frame."""
        shares = self._shares(values)
        shares *= _STEPS - 1
        shares += 0.5
        places = np.clip(shares, 0, _STEPS - 1, out=shares).astype(np.intp)
        return _linear_viridis().take(places, axis=0)

    def _shares(self, values: np.ndarray) -> np.ndarray:
        """How far along the scale values lie: 0 to 1, or beyond."""
        if self.metric.scale == "log":
            values, low, high = np.log(np.maximum(values, 1e-12)), np.log(self.low), np.log(self.high)
        else:
            low, high = self.low, self.high
        return (values - low) / (high - low)

    def severity(self, values: np.ndarray) -> np.ndarray:
        """How far each value is from that of an undeformed mesh; largest where it is worst."""
        if self.metric.scale == "log":
            return np.abs(np.log(np.maximum(values, 1e-12)))
        return np.abs(values)

    def ticks(self, count: int = 5) -> list[float]:
        """Values at even distances along the legend, from the low end to the high one."""
        if self.metric.scale == "log":
            return np.geomspace(self.low, self.high, count).tolist()
        return np.linspace(self.low, self.high, count).tolist()


def _largest(metric: Metric, summaries: Sequence[Summary]) -> float:
    return _magnitude(metric, [value for summary in summaries for value in summary.extremes(metric.name)])


def _magnitude(metric: Metric, values: Sequence[float]) -> float:
    """The largest; of a ratio in doublings or halvings."""
    if metric.scale == "log":
        # A face or an edge may have shrunk to nothing.
        return max((abs(float(np.log2(max(value, 1e-12)))) for value in values), default=0.0)
    return max((abs(value) for value in values), default=0.0)
