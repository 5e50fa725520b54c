# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds which times of two clips are the same moment of a motion, by dynamic time warping of their poses.

The path through the matrix of pose distances has slopes from 1/2 to 2 (Sakoe and Chiba 1978, P = 1), so that
each time of one clip has one of the other, and no clip stands still. For cycles every offset is tried, and
the ends of the path are the same moment. With a blended timing, clips warped in this way are the registration
curves of Kovar and Gleicher 2003.
"""

from dataclasses import dataclass

import numpy as np

from .clip import Clip

# The number of steps of a clip that are compared.
PHASES = 64
# The number of steps over which a path is smoothed, as it is made of whole steps.
SMOOTH = 9


@dataclass(frozen=True)
class Warp:
    """The phase of a clip relative to a reference.

    own  [PHASES + 1]: the clip's phase, 0 to 1, at even phases of the reference; increasing. For a cycle it
         begins
         anywhere, and ends 1 later.
    """

    own: np.ndarray

    def at(self, phases: np.ndarray) -> np.ndarray:
        """[phases]: the clip's phase; whole cycles are added."""
        whole = np.floor(phases)
        # The end of the last cycle is not the beginning of another: a clip that is no cycle has only one.
        whole = np.where((phases == whole) & (phases > 0.0), whole - 1.0, whole)
        even = np.linspace(0.0, 1.0, len(self.own))
        return whole + np.interp(phases - whole, even, self.own)


def same_pace() -> Warp:
    return Warp(np.linspace(0.0, 1.0, PHASES + 1))


def features(clip: Clip, bones: np.ndarray) -> np.ndarray:
    """[PHASES (of a cycle) or PHASES + 1, numbers]: positions and velocities of the ends of `bones` (bool) in
    the in-place clip; each part with mean 0 and mean square 1, so that a long stride is comparable with a
    short one."""
    phases = np.arange(PHASES + (not clip.is_cyclic)) / PHASES
    posed = clip.rig.to_armature(clip.at(phases * clip.length).rigid)
    places = clip.rig.points(posed)[:, bones].reshape(len(phases), -1)
    if clip.is_cyclic:
        paces = np.roll(places, -1, axis=0) - np.roll(places, 1, axis=0)
    else:
        paces = np.gradient(places, axis=0)
    parts = []
    for part in (places - places.mean(axis=0), paces):
        size = np.sqrt((part**2).sum(axis=1).mean())
        parts.append(part / size if size > 1e-9 * clip.rig.size else np.zeros_like(part))
    return np.hstack(parts)


def align(reference: Clip, clip: Clip, bones: np.ndarray) -> Warp:
    """Returns the warp of `clip`, compared by `bones` (bool) alone. Both clips are in place, and both or
    neither are cycles."""
    if reference.length == 0.0 or clip.length == 0.0:
        return same_pace()
    a, b = features(reference, bones), features(clip, bones)
    # All times are alike in a clip that stands still.
    if not a.any() or not b.any():
        return same_pace()
    cost = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    return Warp(_smooth(*_path(cost, clip.is_cyclic), clip.is_cyclic))


def _path(cost: np.ndarray, is_cyclic: bool) -> tuple[np.ndarray, np.ndarray]:
    """Steps [nodes] of the reference, from 0 to PHASES, and of the clip along the cheapest path."""
    n = PHASES
    starts = np.arange(n) if is_cyclic else np.zeros(1, dtype=int)
    steps = np.arange(n + 1)
    if is_cyclic:
        # [starts, n + 1, n + 1]: for a clip that begins at each of its steps.
        cost = cost[steps[None, :, None] % n, (starts[:, None, None] + steps[None, None]) % n]
    else:
        cost = cost[None]
    # If other paths cost the same, the diagonal from the first step is preferred.
    slack = 1e-9 * (1.0 + cost.mean())
    total = np.full(cost.shape, np.inf)
    came = np.zeros(cost.shape, dtype=np.int8)
    total[:, 0, 0] = cost[:, 0, 0] + slack * np.minimum(starts, n - starts)
    for i in range(1, n + 1):
        here = cost[:, i]
        ways = np.full((3, len(starts), n + 1), np.inf)
        ways[0, :, 1:] = total[:, i - 1, :-1] + 2.0 * here[:, 1:]
        ways[1, :, 2:] = total[:, i - 1, :-2] + 2.0 * here[:, 1:-1] + here[:, 2:] + slack
        if i > 1:
            ways[2, :, 1:] = total[:, i - 2, :-1] + 2.0 * cost[:, i - 1, 1:] + here[:, 1:] + slack
        came[:, i] = np.argmin(ways, axis=0)
        total[:, i] = np.min(ways, axis=0)
    start = int(np.argmin(total[:, n, n]))
    nodes = [(n, n)]
    while nodes[-1] != (0, 0):
        i, j = nodes[-1]
        di, dj = ((1, 1), (1, 2), (2, 1))[came[start, i, j]]
        nodes.append((i - di, j - dj))
    of_reference, of_clip = np.array(nodes[::-1]).T
    # The nearer way: just before the clip's first pose, instead of nearly at its end.
    begin = int(starts[start])
    return of_reference, of_clip + (begin - n if begin > n // 2 else begin)


def _smooth(of_reference: np.ndarray, of_clip: np.ndarray, is_cyclic: bool) -> np.ndarray:
    """[PHASES + 1]: the path as phases, averaged over neighbours, which keeps it increasing."""
    own = np.interp(np.arange(PHASES + 1), of_reference, of_clip) / PHASES
    half = SMOOTH // 2
    if is_cyclic:
        longer = np.concatenate([own[-half - 1 : -1] - 1.0, own, own[1 : half + 1] + 1.0])
    else:
        longer = np.pad(own, half, mode="reflect", reflect_type="odd")
    return np.convolve(longer, np.full(SMOOTH, 1.0 / SMOOTH), mode="valid")
