# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of a motion, for faults that are visible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sinew import quat_vec

from ..errors import SinewError
from .blend import Blend
from .clip import Clip

# Below this share of a clip's height a foot counts as on the ground: 2.5 cm of 1.7 m (Zhang et al. 2018).
NEAR_GROUND = 0.015


@dataclass(frozen=True)
class Measures:
    """Measures of a clip.

    sliding               how far feet on the ground slide in a frame, mean; 0 without feet
    travel                how far the root moves over the ground in a frame, mean
    angular_acceleration  root of the mean square over bones and frames, degrees per second squared
    worst_acceleration    its largest value
    """

    sliding: float
    travel: float
    angular_acceleration: float
    worst_acceleration: float


@dataclass(frozen=True)
class Shrinking:
    """The smallest determinant of a blend, with its bone and frame; and the largest distance of a head from
    its parent."""

    volume: float
    bone: str
    frame: int
    apart: float


def measure(clip: Clip, feet: Sequence[int], root: int, up: np.ndarray, frames_a_second: float) -> Measures:
    """Measures a clip as it is keyed, with its travel.

    feet  bones; at each frame their lower end counts. For example from feet_of()
    """
    rig, rigid = clip.rig, clip.poses.rigid
    posed = rig.to_armature(rigid)
    places = posed[:, root, 4:]
    flat = places - (places @ up)[:, None] * up
    travel = np.linalg.norm(np.diff(flat, axis=0), axis=1)
    # Per frame, as samples need not be whole frames.
    pace = (len(rigid) - 1) / clip.length if clip.length else 1.0
    spin = _angular_velocity(rigid) * pace * frames_a_second
    change = np.linalg.norm(np.diff(spin, axis=0), axis=-1) * pace * frames_a_second
    change = np.degrees(change)
    return Measures(
        _mean_sliding(clip, feet, up) * pace if len(feet) and len(rigid) > 1 else 0.0,
        float(travel.mean() * pace) if len(travel) else 0.0,
        float(np.sqrt((change**2).mean())) if change.size else 0.0,
        float(change.max(initial=0.0)),
    )


def shrinking(blend: Blend) -> Shrinking:
    frame, bone = np.unravel_index(np.argmin(blend.volume), blend.volume.shape)
    return Shrinking(
        float(blend.volume[frame, bone]),
        blend.rig.names[bone],
        int(frame),
        float(blend.apart.max(initial=0.0)),
    )


def sliding(clip: Clip, feet: Sequence[int], up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """[samples - 1, feet]: how far each foot moves along the ground to the next sample, and how much it is on
    the ground then.

    On the ground is 2 - 2^(h / H), where h is its height above its lowest position: 1 at 0, and 0 from the
    height H on (Zhang, Starke, Komura, Saito 2018, section 8), so there is no threshold at which a foot
    begins to count.
    """
    rig = clip.rig
    ends = rig.points(rig.to_armature(clip.poses.rigid))[:, list(feet)]
    heights = ends @ up
    lower = np.argmin(heights.mean(axis=0), axis=-1)
    chosen = np.arange(len(feet))
    places, heights = ends[:, chosen, lower], heights[:, chosen, lower]
    heights = heights - heights.min(axis=0)
    limit = NEAR_GROUND * rig.size
    height = 0.5 * (heights[1:] + heights[:-1])
    step = np.diff(places, axis=0)
    step -= (step @ up)[..., None] * up
    return np.linalg.norm(step, axis=-1), np.clip(2.0 - 2.0 ** (height / limit), 0.0, 1.0)


def _mean_sliding(clip: Clip, feet: Sequence[int], up: np.ndarray) -> float:
    steps, on_ground = sliding(clip, feet, up)
    return float((steps * on_ground).sum() / max(on_ground.sum(), 1e-9))


def feet_of(clip: Clip, up: np.ndarray) -> list[int]:
    """Returns the bones that come closest to the ground: of the bones without children, those whose lower end
    is at some time within NEAR_GROUND of the lowest of all."""
    rig = clip.rig
    heights = (rig.points(rig.to_armature(clip.poses.rigid)) @ up).min(axis=(0, 2))
    ends = ~np.isin(np.arange(len(rig.names)), rig.parents)
    near = heights - heights[ends].min(initial=np.inf) <= 2.0 * NEAR_GROUND * rig.size
    return [int(bone) for bone in np.flatnonzero(ends & near)]


def bones_named(clip: Clip, names: Sequence[str]) -> list[int]:
    """Raises SinewError for a bone that the rig does not have."""
    missing = [name for name in names if name not in clip.rig.names]
    if missing:
        raise SinewError(f"There is no bone {missing[0]!r}; choose feet of this armature")
    return [clip.rig.index(name) for name in names]


def _angular_velocity(rigid: np.ndarray) -> np.ndarray:
    """[samples - 1, bones, 3]: the rotation vector from each sample to the next, radians."""
    step = quat_vec.compose(quat_vec.inverse(rigid[:-1]), rigid[1:])
    return quat_vec.to_twist(step)[..., :3]
