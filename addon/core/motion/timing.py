# SPDX-License-Identifier: GPL-3.0-or-later
"""When each clip is played in a blend, and with which weight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SinewError, WrongUse
from .align import Warp
from .clip import Clip

# Steps of a cycle in which its timing is added up.
STEPS = 512
# Of a blend: frames beyond which something was mistyped.
MOST_FRAMES = 100_000


@dataclass(frozen=True)
class Timing:
    """times [frames, clips], in frames after each clip's first; weights [frames, clips] of sum 1."""

    times: np.ndarray
    weights: np.ndarray


def checked_weights(weights: Sequence[float], count: int) -> np.ndarray:
    """[count] of sum 1. Raises SinewError where they are not such."""
    given = np.array(weights, dtype=np.float64)
    if given.shape != (count,):
        raise WrongUse(f"Weights: expected one for each of {count} clips, got {given.size}")
    if not np.isfinite(given).all() or (given < 0.0).any() or given.sum() <= 0.0:
        raise WrongUse("Weights: expected numbers of 0 or more, and not all of them 0")
    return given / given.sum()


def lengths_of(clips: Sequence[Clip]) -> np.ndarray:
    """[clips]: frames; a single pose is as long as the others are on average."""
    lengths = np.array([clip.length for clip in clips])
    others = lengths[lengths > 0.0]
    return np.where(lengths > 0.0, lengths, others.mean() if len(others) else 0.0)


def own_pace(clips: Sequence[Clip], first: np.ndarray, last: np.ndarray, cycles: int) -> Timing:
    """Every clip from its first frame at its own pace, for the longest that has a weight."""
    used = (first > 0.0) | (last > 0.0)
    lengths = lengths_of(clips)
    frames = _whole(cycles * lengths[used].max())
    times = np.repeat(np.arange(frames + 1.0)[:, None], len(clips), axis=1)
    return Timing(times, _weights(np.linspace(0.0, 1.0, frames + 1), first, last))


def aligned(
    clips: Sequence[Clip], warps: Sequence[Warp], first: np.ndarray, last: np.ndarray, cycles: int
) -> Timing:
    """Clips at the same moment of their motion. A moment takes the weighted mean of the times that it takes
    in each: so a blend is as long as the weighted mean of its clips, to whole frames, and one of a single
    clip plays that as it is. Weights go from `first` to `last` in step with the motion."""
    lengths = lengths_of(clips)
    _whole(cycles * float(np.minimum(first @ lengths, last @ lengths)))
    phases = np.linspace(0.0, cycles, STEPS * cycles + 1)
    own = np.column_stack([warp.at(phases) * length for warp, length in zip(warps, lengths, strict=True)])
    weights = _weights(phases / cycles, first, last)
    taken = (0.5 * (weights[1:] + weights[:-1]) * np.diff(own, axis=0)).sum(axis=1)
    when = np.concatenate([[0.0], np.cumsum(taken)])
    frames = _whole(when[-1])
    at = np.interp(np.linspace(0.0, when[-1], frames + 1), when, phases)
    times = np.column_stack([np.interp(at, phases, each) for each in own.T])
    return Timing(times, _weights(at / cycles, first, last))


def _whole(frames: float) -> int:
    if frames > MOST_FRAMES:
        raise SinewError(
            f"The blend would have {frames:,.0f} frames, more than {MOST_FRAMES:,}: choose fewer cycles"
        )
    return max(1, round(frames)) if frames > 0.0 else 0


def _weights(shares: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    return (1.0 - shares[:, None]) * first + shares[:, None] * last
