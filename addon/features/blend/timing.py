# SPDX-License-Identifier: GPL-3.0-or-later
"""When each clip is played in a blend, and with which weight."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...base.errors import SinewError, WrongUse
from .align import Warp
from .clip import Clip

# The number of steps in which a cycle's timing is summed.
STEPS = 512
# Longer blends are taken for typing errors.
MOST_FRAMES = 100_000


@dataclass(frozen=True)
class Timing:
    """Times and weights of a blend's clips.

    times    [frames, clips], in frames after each clip's first
    weights  [frames, clips], of sum 1
    """

    times: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True)
class Weights:
    """Weights of a blend's clips, of sum 1, [clips]: they go evenly from the first to the last."""

    first: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, given: Sequence, count: int) -> Self:
        """given: the weights of `count` clips; or those at the beginning, and those at the end.

        Raises WrongUse where they are invalid.
        """
        both = given if np.ndim(given[0]) > 0 else (given, given)
        values = [np.array(each, dtype=np.float64) for each in both]
        for each in values:
            if each.shape != (count,):
                raise WrongUse(f"Weights: expected one for each of {count} clips, got {each.size}")
            if not np.isfinite(each).all() or (each < 0.0).any() or each.sum() <= 0.0:
                raise WrongUse("Weights: expected numbers of 0 or more, and not all of them 0")
        return cls(*(each / each.sum() for each in values))

    @property
    def change(self) -> bool:
        return bool((self.first != self.last).any())

    def over(self, shares: np.ndarray) -> np.ndarray:
        """[n, clips] at n shares of the motion, from 0 to 1."""
        return self.first + shares[:, None] * (self.last - self.first)


def lengths_of(clips: Sequence[Clip]) -> np.ndarray:
    """[clips]: lengths in frames; a single pose gets the mean of the others."""
    lengths = np.array([clip.length for clip in clips])
    others = lengths[lengths > 0.0]
    return np.where(lengths > 0.0, lengths, others.mean() if len(others) else 0.0)


def own_pace(clips: Sequence[Clip], weights: Weights, cycles: int) -> Timing:
    """Returns the timing where every clip plays from its first frame at its own speed, for the longest that
    has a weight."""
    used = (weights.first > 0.0) | (weights.last > 0.0)
    lengths = lengths_of(clips)
    frames = _whole(cycles * lengths[used].max())
    times = np.repeat(np.arange(frames + 1.0)[:, None], len(clips), axis=1)
    return Timing(times, weights.over(np.linspace(0.0, 1.0, frames + 1)))


def aligned(clips: Sequence[Clip], warps: Sequence[Warp], weights: Weights, cycles: int) -> Timing:
    """Returns the timing where clips are at the same moment of their motion. A moment takes the weighted mean
    of its times in each clip: so a blend is as long as the weighted mean of its clips, in whole frames, and a
    blend of one clip plays it unchanged. Weights change in step with the motion."""
    lengths = lengths_of(clips)
    _whole(cycles * min(float(weights.first @ lengths), float(weights.last @ lengths)))
    phases = np.linspace(0.0, cycles, STEPS * cycles + 1)
    own = np.column_stack([warp.at(phases) * length for warp, length in zip(warps, lengths, strict=True)])
    in_steps = weights.over(phases / cycles)
    taken = (0.5 * (in_steps[1:] + in_steps[:-1]) * np.diff(own, axis=0)).sum(axis=1)
    when = np.concatenate([[0.0], np.cumsum(taken)])
    frames = _whole(when[-1])
    at = np.interp(np.linspace(0.0, when[-1], frames + 1), when, phases)
    times = np.column_stack([np.interp(at, phases, each) for each in own.T])
    return Timing(times, weights.over(at / cycles))


def _whole(frames: float) -> int:
    if frames > MOST_FRAMES:
        raise SinewError(
            f"The blend would have {frames:,.0f} frames, more than {MOST_FRAMES:,}: choose fewer cycles"
        )
    return max(1, round(frames)) if frames > 0.0 else 0
