# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat map colours: the range of values, perceptually uniform colour maps, the legend's numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np

from .metrics import Metric, Summary

# Every fifth colour of viridis (S. van der Walt, N. Smith, 2015; CC0), sRGB.
_VIRIDIS = bytes.fromhex(
    "44015446085c471063481769481d6f482475472a7a46307e453781433d844142873f48893d4e8a3a538b38598c355e8d"
    "33638d31688e2e6d8e2c718e2a768e297b8e27808e25848e23898e218e8d20928c1f978b1e9c891fa18821a58524aa83"
    "28ae802eb37c35b7793dbc7446c06f50c46a5ac86465cb5e70cf577cd25089d54895d840a2da37b0dd2fbddf26cae11f"
    "d8e219e5e419f1e51dfde725"
)
# A range of ratios covers at most, and at least, this many doublings or halvings.
MAX_DOUBLINGS = 2.0
MIN_DOUBLINGS = 0.1
# A range of lengths ends at most at this multiple of the second largest method's maximum.
BEYOND_OTHERS = 2.0


def viridis(shares: np.ndarray) -> np.ndarray:
    """float64 [n, 3], sRGB in 0..1: dark violet at 0, green at 0.5, yellow at 1; clipped outside."""
    stops = np.frombuffer(_VIRIDIS, dtype=np.uint8).reshape(-1, 3) / 255.0
    positions = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(shares, positions, channel) for channel in stops.T], axis=-1)


# The two sides of the diverging map: lightness and chroma in Oklab at the ends and in the middle. Blue and
# orange differ for all dichromats, and the neutral middle is nearly white.
_MIDDLE_LIGHTNESS, _END_LIGHTNESS, _END_CHROMA = 0.95, 0.47, 0.135
_BELOW, _ABOVE = np.radians(252.0), np.radians(50.0)
# From Oklab to linear sRGB (B. Ottosson, 2020, "A perceptual color space for image processing").
_LMS_FROM_OKLAB = np.array(
    [
        [1.0, 0.3963377774, 0.2158037573],
        [1.0, -0.1055613458, -0.0638541728],
        [1.0, -0.0894841775, -1.2914855480],
    ]
)
_RGB_FROM_LMS = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)


def diverging(shares: np.ndarray) -> np.ndarray:
    """float64 [n, 3], sRGB in 0..1: blue at 0, nearly white at 0.5, orange brown at 1; clipped outside."""
    away = 2.0 * np.clip(np.asarray(shares, dtype=np.float64), 0.0, 1.0) - 1.0
    hue, far = np.where(away < 0.0, _BELOW, _ABOVE), np.abs(away)
    lightness = _MIDDLE_LIGHTNESS + far * (_END_LIGHTNESS - _MIDDLE_LIGHTNESS)
    # Pale colours get less chroma than a straight line would give, which would leave sRGB.
    chroma = _END_CHROMA * np.sin(0.5 * np.pi * far)
    oklab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    rgb = np.clip((oklab @ _LMS_FROM_OKLAB.T) ** 3 @ _RGB_FROM_LMS.T, 0.0, 1.0)
    return np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1.0 / 2.4) - 0.055)


# Finer than the steps of 8-bit colours.
_STEPS = 1024


@cache
def _linear_table(colour_map: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    return linear(colour_map(np.linspace(0.0, 1.0, _STEPS))).astype(np.float32)


def linear(colours: np.ndarray) -> np.ndarray:
    """Converts sRGB colours in 0..1 to scene-linear ones, which Blender stores."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True)
class HeatScale:
    """The range of values that the colours cover, from `low` to `high`.

    clipped  some values are outside the range; they get the first or last colour
    """

    metric: Metric
    low: float
    high: float
    clipped: bool = False

    @classmethod
    def over(cls, metric: Metric, methods: Sequence[Sequence[Summary]], diagonal: float) -> Self:
        """Returns a range for all shapes of the summaries, of one frame or of many, so that colours can be
        compared.

        methods   for each method its summaries; outliers of a single method are clipped
        diagonal  of the rest shape: the range of lengths is at least a ten thousandth of it
        """
        of_each = [[value for each in own for value in each.extremes(metric.name)] for own in methods]
        return cls._up_to(metric, [_magnitude(metric, values) for values in of_each], diagonal)

    @classmethod
    def over_values(cls, metric: Metric, least: float, most: float, diagonal: float) -> Self:
        """Returns a range for values from `least` to `most`."""
        return cls._up_to(metric, [_magnitude(metric, [least, most])], diagonal)

    @classmethod
    def fixed(cls, metric: Metric, end: float, least: float, most: float) -> Self:
        """Returns a range that ends at `end`, a length or a ratio above 1, for values from `least` to
        `most`."""
        beyond = _magnitude(metric, [least, most])
        return cls._to(metric, end, beyond > (np.log2(end) if metric.scale == "log" else end))

    @classmethod
    def _to(cls, metric: Metric, end: float, clipped: bool) -> Self:
        if metric.unit == "share":
            return cls(metric, 0.0, 1.0)
        low = {"linear": 0.0, "signed": -end, "log": 1.0 / end}[metric.scale]
        return cls(metric, low, end, bool(clipped))

    @classmethod
    def _up_to(cls, metric: Metric, largest: Sequence[float], diagonal: float) -> Self:
        """largest: the largest magnitude of each method."""
        largest = sorted(largest, reverse=True)
        beyond = max(largest, default=0.0)
        if metric.scale == "log":
            factor = 2.0 ** float(np.clip(beyond, MIN_DOUBLINGS, MAX_DOUBLINGS))
            return cls._to(metric, factor, beyond > MAX_DOUBLINGS)
        least = max(1e-4 * diagonal, 1e-12)
        most = beyond
        if len(largest) > 1 and largest[1] > least:
            most = min(most, BEYOND_OTHERS * largest[1])
        end = max(most, least)
        return cls._to(metric, end, beyond > end)

    def colours(self, values: np.ndarray) -> np.ndarray:
        """float64 [n, 3], sRGB in 0..1."""
        return self.ramp(self._shares(values))

    @property
    def ramp(self) -> Callable[[np.ndarray], np.ndarray]:
        """The colour map from `low` to `high`: viridis for magnitudes, else diverging from the neutral value,
        such as 1 for a ratio."""
        return viridis if self.metric.scale == "linear" else diverging

    def linear_colours(self, values: np.ndarray) -> np.ndarray:
        """float32 [n, 3], scene-linear, accurate to 0.002: from a table, as it is computed in every frame."""
        shares = self._shares(values)
        shares *= _STEPS - 1
        shares += 0.5
        indices = np.clip(shares, 0, _STEPS - 1, out=shares).astype(np.intp)
        return _linear_table(self.ramp).take(indices, axis=0)

    def _shares(self, values: np.ndarray) -> np.ndarray:
        """Positions of values on the scale: 0 at `low`, 1 at `high`; 2 where a shape is not finite, so that a
        value is not a number."""
        if self.metric.scale == "log":
            values, low, high = np.log(np.maximum(values, 1e-12)), np.log(self.low), np.log(self.high)
        else:
            low, high = self.low, self.high
        return np.fmin((values - low) / (high - low), 2.0)

    def severity(self, values: np.ndarray) -> np.ndarray:
        """How far each value is from that of an undeformed mesh: the larger, the worse."""
        if self.metric.scale == "log":
            return np.abs(np.log(np.maximum(values, 1e-12)))
        return np.abs(values)

    def ticks(self, count: int = 5) -> list[float]:
        """Values at equal distances along the legend, from `low` to `high`."""
        if self.metric.scale == "log":
            return np.geomspace(self.low, self.high, count).tolist()
        return np.linspace(self.low, self.high, count).tolist()


def _magnitude(metric: Metric, values: Sequence[float]) -> float:
    """The largest magnitude; for a ratio, in doublings or halvings."""
    if metric.scale == "log":
        # A face or an edge may have shrunk to zero.
        return max((abs(float(np.log2(max(value, 1e-12)))) for value in values), default=0.0)
    return max((abs(value) for value in values), default=0.0)
