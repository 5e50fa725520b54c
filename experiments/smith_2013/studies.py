# SPDX-License-Identifier: GPL-3.0-or-later
"""Repeats what the report concludes from one chain with many random ones."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import numpy as np
import sinew

from .fits import horn, kabsch, walker
from .tables import LAYOUTS

CHAINS = 2000
LENGTHS = (4, 16, 64, 256)
# Where nlerp and slerp differ most, and near it; the second half of the interval is symmetric.
TIMES = (0.1, 0.2, 0.3)


@dataclass(frozen=True)
class Spread:
    """The distribution of a number over all chains: root mean square, and 5th and 95th percentile."""

    rms: float
    low: float
    high: float

    @classmethod
    def of(cls, values: np.ndarray) -> Spread:
        low, high = np.quantile(values, (0.05, 0.95))
        return cls(float(np.sqrt(np.mean(np.square(values)))), float(low), float(high))


def _random_axes(random: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    axes = random.normal(size=(*shape, 3))
    return axes / np.linalg.norm(axes, axis=-1, keepdims=True)


def _links(axes: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """float64 [chains, length, 7]: pairs that rotate, then move on by 1."""
    pairs = sinew.quat_vec.from_axis_angle(axes, angles)
    pairs[..., 4] = 1.0
    return pairs


@cache
def accuracy(length: int, chains: int = CHAINS) -> dict[str, Spread]:
    """By representation: how far the end of a chain, combined in float32, is from the float64 result, as a
    share of the chain's length."""
    random, shape = np.random.default_rng(length), (chains, length)
    pairs = _links(_random_axes(random, shape), random.uniform(-np.pi, np.pi, shape))
    exact = _end(sinew.quat_vec, pairs)
    found = {}
    for name, module in LAYOUTS.items():
        # Each from the same pairs, rounded to float32.
        single = pairs.astype(np.float32)
        links = single if name == "quat_vec" else getattr(sinew.quat_vec, f"to_{name}")(single)
        distance = np.linalg.norm(_end(module, links).astype(np.float64) - exact, axis=-1)
        found[name] = Spread.of(distance / length)
    return found


def _end(module: Any, links: np.ndarray) -> np.ndarray:
    """[chains, 3]: the position of the last link's origin."""
    whole = links[:, 0]
    for link in range(1, links.shape[1]):
        whole = module.compose(whole, links[:, link])
    return module.transform_point(whole, np.zeros(3, links.dtype))


@cache
def fits(sets: int = CHAINS) -> dict[str, Spread]:
    """By representation: the degrees between the true rotation of 12 points and the one fitted in float32 to
    them and their targets, which have errors of a hundredth of their size."""
    random = np.random.default_rng(sets)
    source = random.normal(size=(sets, 12, 3))
    true = sinew.affine.from_axis_angle(random.normal(size=(sets, 3)), random.uniform(-np.pi, np.pi, sets))
    target = sinew.affine.transform_point(true[:, None], source) + 0.01 * random.normal(size=source.shape)
    single = source.astype(np.float32), target.astype(np.float32)
    double = [points.astype(np.float64) for points in single]
    solved = {
        "affine": kabsch(*double).astype(np.float32),
        "quat_vec": horn(*double).astype(np.float32),
        "dual_quat": walker(*double).astype(np.float32),
    }
    found = {}
    for name, fit in solved.items():
        exact = fit.astype(np.float64)
        matrices = exact if name == "affine" else LAYOUTS[name].to_affine(exact)
        matrices = sinew.affine.normalized(matrices)
        found[name] = Spread.of(np.degrees(sinew.affine.rigid_distance(true, matrices).angle))
    return found


@cache
def drift(length: int, chains: int = CHAINS, most: float = np.pi / 4) -> Spread:
    """The largest distance over TIMES between the tips of a chain under DLB and ScLERP, as a share of its
    length. Each joint rotates about its own axis from one angle to another, both up to `most` radians."""
    random, shape = np.random.default_rng(length), (chains, length)
    axes = _random_axes(random, shape)
    first, second = (
        sinew.quat_vec.to_dual_quat(_links(axes, random.uniform(-most, most, shape))) for _key in range(2)
    )
    worst = np.zeros(chains)
    for t in TIMES:
        tips = [
            _end(sinew.dual_quat, sinew.interpolate.between(first, second, t, method).transforms)
            for method in ("dlb", "sclerp")
        ]
        worst = np.maximum(worst, np.linalg.norm(tips[0] - tips[1], axis=-1))
    return Spread.of(worst / length)


def numbers() -> dict[str, dict[str, dict[str, float]]]:
    """Returns all of the above by "study, length" and representation or method, as in report.json."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for length in LENGTHS:
        found[f"accuracy, {length}"] = {name: asdict(spread) for name, spread in accuracy(length).items()}
        found[f"drift, {length}"] = {"dlb": asdict(drift(length))}
    found["fits"] = {name: asdict(spread) for name, spread in fits().items()}
    return found
