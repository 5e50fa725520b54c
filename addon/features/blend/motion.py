# SPDX-License-Identifier: GPL-3.0-or-later
"""Blends clips of one armature: `sinew.interpolate.blend` over all frames and bones at once.

Smith 2013, section 4.1, describes it. Rigid parts are blended by the method; the scale is the mean of the
clips' scales, with the same weights, as Blender stores a bone's scale separately from its rotation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sinew import interpolate, quat_vec

from ...base.errors import WrongUse
from ...base.options import option
from ...io.poses import Poses
from ..inbetween.interpolation import Method, in_layout_of, inbetweens, rigid_of
from . import timing
from .align import Warp, align, same_pace
from .clip import Clip, Rig, common_rig
from .root import Grounded, accumulated, as_keyed, carried, grounded, main_root

TRAVEL, IN_PLACE, KEYED = "travel", "in-place", "keyed"


# In the order of menus, the recommended method first; numbers are those of the in-betweens. "sclerp" and
# "dib" are one method, for two and for many transforms.
METHODS = {
    method.name: method
    for method in (
        Method("dlb", "Dual Quaternions (recommended)", "Rigid; bones swing nearly along screws. DLB", 6),
        Method("sclerp", "Screw", "The screw between two, at an even pace; of more as DIB. ScLERP", 7),
        Method("dib", "Screw of Many", "Dual quaternions blended iteratively, evenly. DIB", 8),
        Method("qv_nlerp", "Quaternion and Vector", "Rigid; rotation and location blended apart. Nlerp", 4),
        Method("qv_slerp", "Quaternion and Vector, Even", "Mean rotation on the sphere, mean location", 5),
        Method("matrix_polar", "Matrix Made Rigid", "Mean matrix, brought back to the nearest rotation", 2),
        Method("matrix_log", "Log-Matrix", "Mean of logarithms: rigid, dependent on the rest pose", 3),
        Method("matrix_linear", "Linear Matrix", "Mean matrix: bones shrink where clips differ", 1),
    )
}


@dataclass(frozen=True)
class Settings:
    """How clips are blended."""

    method: interpolate.Method = option(
        "dlb",
        "Method",
        "How poses of a bone are blended",
        choices=[(m.name, m.label, m.description, m.number) for m in METHODS.values()],
    )
    align: bool = option(
        True,
        "Align",
        "Bring the actions to the same moment of their motion, and cycles to a common length; "
        "else each plays from its first frame",
    )
    cycles: int = option(
        1, "Cycles", "How often actions that repeat go round in the blend", least=1, soft_most=20
    )
    root_motion: str = option(
        TRAVEL,
        "Root Motion",
        "What becomes of the way that the root goes over the ground",
        choices=(
            (TRAVEL, "Blended", "Steps of the root are blended and added up: speeds and turns blend", 0),
            (IN_PLACE, "In Place", "The way over the ground is taken out", 1),
            (KEYED, "As Keyed", "The root is blended as any other bone", 2),
        ),
    )
    root: str = option("", "Root", "The bone that carries the others; empty: the uppermost that moves")


@dataclass(frozen=True)
class Blend:
    """The result of a blend.

    poses      [frames, bones, ..], each bone relative to its parent and rest
    volume     [frames, bones]: determinant of the method's result; below 1 a bone shrinks
    undefined  bool [frames, bones]: where sinew.interpolate.blend says that its result is not defined
    timing     of each clip in each frame
    warps      of the clips
    root       the bone that carried the others, None where root motion is as keyed
    is_cyclic  the last pose equals the first, except for its travel
    """

    rig: Rig
    poses: Poses
    volume: np.ndarray
    undefined: np.ndarray
    timing: timing.Timing
    warps: list[Warp]
    root: str | None
    is_cyclic: bool

    def clip(self, name: str) -> Clip:
        return Clip(name, self.rig, self.poses, float(len(self.poses.rigid) - 1), self.is_cyclic)

    def smallest(self) -> tuple[float, str, int]:
        """Returns the least volume, with its bone and frame."""
        frame, bone = np.unravel_index(np.argmin(self.volume), self.volume.shape)
        return float(self.volume[frame, bone]), self.rig.names[bone], int(frame)


def blend(
    clips: Sequence[Clip],
    weights: Sequence,
    settings: Settings | None = None,
    up: Sequence[float] = (0.0, 0.0, 1.0),
) -> Blend:
    """Blends clips by weights, scaled to sum 1.

    Whether a clip is a cycle is found from its poses, or given by `Clip.is_cyclic`. Where some are none, all
    are aligned from their first pose to their last. The clip with the largest weight at the beginning is the
    reference: the blend begins where it does.

    weights  of the clips; or those at the beginning, and those at the end
    up       [3], the vertical in armature space, of length 1

    Raises SinewError for impossible settings, weights or bones.
    """
    settings = Settings() if settings is None else settings
    rig = common_rig(clips)
    shares = timing.Weights.of(weights, len(clips))
    _check(settings)
    reference = int(np.argmax(shares.first))
    root = rig.index(settings.root) if settings.root else main_root(rig, list(clips))
    travels = _in_place(clips, root, np.asarray(up), settings)
    placed = [travel.clip for travel in travels]
    warps = _warps(placed, reference, rig, root, settings)
    cycles = settings.cycles if all(clip.is_cyclic for clip in placed) or not settings.align else 1
    schedule = (
        timing.aligned(placed, warps, shares, cycles)
        if settings.align
        else timing.own_pace(placed, shares, cycles)
    )
    sampled = [clip.at(times) for clip, times in zip(placed, schedule.times.T, strict=True)]
    poses, volume, undefined = _blended(sampled, schedule.weights, settings.method)
    if settings.root_motion != KEYED:
        ground = _ground(travels, schedule, reference, settings)
        poses = poses._replace(rigid=carried(rig, root, poses.rigid, ground))
    return Blend(
        rig,
        poses,
        volume,
        undefined,
        schedule,
        warps,
        rig.names[root] if settings.root_motion != KEYED else None,
        all(clip.is_cyclic for clip in placed) and not shares.change and settings.align,
    )


def _check(settings: Settings) -> None:
    for what, value, known in (
        ("method", settings.method, tuple(METHODS)),
        ("root motion", settings.root_motion, (TRAVEL, IN_PLACE, KEYED)),
    ):
        if value not in known:
            raise WrongUse(f"{what}: expected one of {', '.join(known)}, got {value!r}")
    if settings.cycles < 1:
        raise WrongUse(f"cycles: expected 1 or more, got {settings.cycles}")


def _in_place(clips: Sequence[Clip], root: int, up: np.ndarray, settings: Settings) -> list[Grounded]:
    """Returns the clips without their travel: all as cycles, or, if that is needed to align them, none."""
    take_out = as_keyed if settings.root_motion == KEYED else grounded
    found = [take_out(clip, root, up, clip.is_cyclic or None) for clip in clips]
    if settings.align and not all(each.clip.is_cyclic for each in found):
        found = [take_out(clip, root, up, False) for clip in clips]
    return found


def _warps(clips: Sequence[Clip], reference: int, rig: Rig, root: int, settings: Settings) -> list[Warp]:
    if not settings.align:
        return [same_pace() for _clip in clips]
    return [
        same_pace() if number == reference else align(clips[reference], clip, rig.below(root))
        for number, clip in enumerate(clips)
    ]


def _ground(
    travels: Sequence[Grounded], schedule: timing.Timing, reference: int, settings: Settings
) -> np.ndarray:
    """[frames, 7]: the ground frames of the blend, starting where the reference starts."""
    frames = [travel.at(times) for travel, times in zip(travels, schedule.times.T, strict=True)]
    start = frames[reference][0]
    count = len(schedule.times)
    if settings.root_motion == IN_PLACE:
        return np.repeat(start[None], count, axis=0)
    steps = [quat_vec.compose(quat_vec.inverse(each[:-1]), each[1:]) for each in frames]
    # A step is blended by the weights at its middle.
    weights = 0.5 * (schedule.weights[1:] + schedule.weights[:-1])
    blended = _of_all(steps, weights, settings.method)
    return accumulated(start, rigid_of(settings.method, blended.transforms))


def _of_all(
    rigid: Sequence[np.ndarray], weights: np.ndarray, method: interpolate.Method
) -> interpolate.Blended:
    """Blends rigid transforms [.., 7] of each clip by weights [.., clips] of sum 1. For two clips the methods
    have a faster way, with the same result."""
    inside = [in_layout_of(method, each) for each in rigid]
    if len(inside) == 2:
        return interpolate.between(inside[0], inside[1], weights[..., 1], method)
    axis = rigid[0].ndim - 1
    return interpolate.blend(np.stack(inside, axis=axis), weights, method)


def _blended(
    sampled: Sequence[Poses], weights: np.ndarray, method: interpolate.Method
) -> tuple[Poses, np.ndarray, np.ndarray]:
    """Blends poses [frames, bones, ..] of clips by weights [frames, clips]. Returns them with `volume` and
    `undefined` of Blend."""
    scale = np.einsum("fc,fcbk->fbk", weights, np.stack([poses.scale for poses in sampled], axis=1))
    blended = _of_all([poses.rigid for poses in sampled], weights[:, None], method)
    volume = np.ones(scale.shape[:2])
    if method == "matrix_linear":
        volume = np.linalg.det(blended.transforms[..., :3, :3])
    found = inbetweens(blended, scale, method)
    return found.poses, volume, ~found.is_defined
