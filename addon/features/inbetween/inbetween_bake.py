# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys in-betweens in a copy of the action, which plays without Sinew."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core import inbetween as core
from ...core.errors import SinewError
from ...io import actions, pose_io
from ..action_copy import action_copy
from . import keyed_poses


@dataclass(frozen=True)
class Settings:
    """How in-betweens are made.

    method  of core.METHODS
    path    core.STRAIGHT or core.SPLINE
    step    frames from one key to the next
    range   keyed poses within these frames; None: all
    only    the bones that move by the method; None: all
    """

    method: str
    path: str = core.STRAIGHT
    step: int = 1
    range: tuple[float, float] | None = None
    only: Collection[str] | None = None


@dataclass
class Baked:
    """What steps() did to an armature, by bone: `bones` were keyed, `left` keep their curves for the reason
    given, `far` are those of `keyed_poses.Pose.far`."""

    armature: bpy.types.Object
    bones: int = 0
    left: dict[str, str] = field(default_factory=dict)
    far: set[str] = field(default_factory=set)

    def notes(self, path: str) -> list[str]:
        kept = [f"{bone} {reason}: it keeps its curves" for bone, reason in sorted(self.left.items())]
        return [*kept, *(f"{bone} {core.TOO_FAR[path]}" for bone in sorted(self.far))]


def steps(armature: bpy.types.Object, settings: Settings, found: list[Baked]) -> Iterator[float]:
    """Has the armature play a copy of its action, in which the bones move by a method between the keyed
    poses, with keys at every `step` frames and linear interpolation; yields the progress.

    The keyed poses stay, also those between whole frames; in-betweens are keys of type Breakdown. If closed
    before the end, everything is as before. Raises SinewError where there is nothing to do.
    """
    with action_copy.playing(armature, core.METHODS[settings.method].label):
        poses = keyed_poses.read(armature, settings.only)
        baked = Baked(armature, left=poses.left)
        wanted = [_times(group, settings) for group in poses.groups]
        baked.bones = sum(
            len(group.rows) for group, times in zip(poses.groups, wanted, strict=True) if len(times)
        )
        if not baked.bones:
            reasons = [f"{bone} {reason}" for bone, reason in sorted(poses.left.items())]
            raise SinewError(
                f"{armature.name}: no bone has two keyed poses here; "
                f"{reasons[0] if reasons else 'key some poses'}"
            )
        times = np.unique(np.concatenate(wanted))
        samples: list[np.ndarray] = []
        modes = np.array([bone.rotation_mode for bone in armature.pose.bones])
        for number, time in enumerate(times):
            pose = keyed_poses.pose_at(armature, poses, float(time), settings.method, settings.path)
            # Rotation values close to the previous ones.
            samples.append(pose_io.closer(pose.channels, modes, samples[-1]) if samples else pose.channels)
            baked.far.update(pose.far)
            yield (number + 1) / len(times)
        for group, own_times in zip(poses.groups, wanted, strict=True):
            values = np.array(samples)[np.searchsorted(times, own_times)]
            for curve, bone, column in zip(group.curves, group.bones, group.columns, strict=True):
                if len(own_times):
                    row = group.rows[bone]
                    _write_keys(curve, group, int(bone), own_times, values[:, row, column])
    found.append(baked)


# Of the first and the last key: what shapes the curve on the other side.
_OUTER = (
    ("handle_left",),
    ("handle_right", "interpolation", "easing", "amplitude", "back", "period"),
)


def _times(group: keyed_poses.Group, settings: Settings) -> np.ndarray:
    """Returns the times of the keys that a group's bones get, float32: the frames, and the artist's keys."""
    keys, outside = group.times, []
    if settings.range is not None:
        keys = keys[(keys >= settings.range[0]) & (keys <= settings.range[1])]
    elif any(map(_extrapolates, group.curves)):
        # A curve with linear extrapolation takes its slope from the last two keys.
        outside = [keys[0] - 1.0, keys[-1] + 1.0]
    if len(keys) < 2:
        return np.empty(0, np.float32)
    frames = np.arange(np.ceil(keys[0]), np.floor(keys[-1]) + 1, settings.step)
    return np.unique(np.concatenate([keys, frames, outside]).astype(np.float32))


def _extrapolates(curve: bpy.types.FCurve) -> bool:
    return curve.extrapolation == "LINEAR" and all(modifier.mute for modifier in curve.modifiers)


def _write_keys(
    curve: bpy.types.FCurve, group: keyed_poses.Group, bone: int, times: np.ndarray, values: np.ndarray
) -> None:
    inside = (times >= group.times[0]) & (times <= group.times[-1])
    chosen = inside | _extrapolates(curve)
    times, values = times[chosen], values[chosen]
    points = curve.keyframe_points
    # The curve from and to keys that stay is as before.
    outer = [
        {name: _value(point, name) for name in names}
        for names, time in zip(_OUTER, (times[0], times[-1]), strict=True)
        for point in points
        if point.co.x == time
    ]
    for point in reversed([point for point in points if times[0] <= point.co.x <= times[-1]]):
        points.remove(point, fast=True)
    kept = len(points)
    points.add(len(times))

    def write(name: str, size: int, new: np.ndarray) -> None:
        dtype = np.float32 if name == "co" else np.int32
        every = np.empty(size * len(points), dtype)
        points.foreach_get(name, every)
        every[size * kept :] = new.ravel()
        points.foreach_set(name, every)

    def choose(name: str, where: np.ndarray, choice: str, otherwise: str) -> None:
        write(name, 1, np.where(where, actions.key_value(name, choice), actions.key_value(name, otherwise)))

    write("co", 2, np.column_stack([times, values]))
    key = np.maximum(np.searchsorted(group.times, times, side="right") - 1, 0)
    choose(
        "interpolation", group.still[key, bone] & (times >= group.times[0]), "CONSTANT", otherwise="LINEAR"
    )
    choose("type", np.isin(times, group.times), "KEYFRAME", otherwise="BREAKDOWN")
    for side in ("handle_left_type", "handle_right_type"):
        choose(side, np.ones(len(times), dtype=bool), "AUTO_CLAMPED", otherwise="AUTO_CLAMPED")
    curve.update()
    if kept and len(outer) == 2:
        for at, values_of_key in zip((times[0], times[-1]), outer, strict=True):
            point = next(point for point in points if point.co.x == at)
            # Blender adapts a handle to its opposite unless both are free.
            point.handle_left_type = point.handle_right_type = "FREE"
            for name, value in values_of_key.items():
                setattr(point, name, value)
        curve.update()


def _value(point: bpy.types.Keyframe, name: str) -> object:
    value = getattr(point, name)
    return value.copy() if name.startswith("handle_") else value
