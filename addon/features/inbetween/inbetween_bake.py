# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys in-betweens in a copy of the action, which plays without Sinew."""

from collections.abc import Collection, Generator
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...base.errors import SinewError
from ...io import actions, pose_io
from ..action_copy import action_copy
from . import interpolation, keyed_poses


@dataclass
class Baked:
    """What steps() did to an armature, by bone: `bones` were keyed, `left` keep their curves for the reason
    given, `far` are those of `keyed_poses.pose_at()`."""

    armature: bpy.types.Object
    bones: int = 0
    left: dict[str, str] = field(default_factory=dict)
    far: set[str] = field(default_factory=set)

    def notes(self, path: str) -> list[str]:
        kept = [f"{bone} {reason}: it keeps its curves" for bone, reason in sorted(self.left.items())]
        return [*kept, *(f"{bone} {interpolation.TOO_FAR[path]}" for bone in sorted(self.far))]


def steps(
    armature: bpy.types.Object,
    method: str,
    path: str = interpolation.STRAIGHT,
    step: int = 1,
    only: Collection[str] | None = None,
) -> Generator[float, None, Baked]:
    """Has the armature play a copy of its action, in which the bones move by a method between the keyed
    poses, with keys at every `step` frames and linear interpolation; yields the progress.

    The keyed poses stay, also those between whole frames; in-betweens are keys of type Breakdown. If closed
    before the end, everything is as before. Raises SinewError where there is nothing to do.

    method  of interpolation.METHODS
    path    interpolation.STRAIGHT or interpolation.SPLINE
    step    frames from one key to the next
    only    the bones that move by the method; None: all
    """
    with action_copy.playing(armature, interpolation.METHODS[method].label):
        groups, left = keyed_poses.read(armature, only)
        baked = Baked(armature, left=left)
        wanted = [_times(group, step) for group in groups]
        baked.bones = sum(len(group.rows) for group, times in zip(groups, wanted, strict=True) if len(times))
        if not baked.bones:
            reasons = [f"{bone} {reason}" for bone, reason in sorted(left.items())]
            raise SinewError(
                f"{armature.name}: no bone has two keyed poses here; "
                f"{reasons[0] if reasons else 'key some poses'}"
            )
        times = np.unique(np.concatenate(wanted))
        samples: list[np.ndarray] = []
        modes = np.array([bone.rotation_mode for bone in armature.pose.bones])
        for number, time in enumerate(times):
            pose, far = keyed_poses.pose_at(armature, groups, float(time), method, path)
            # Rotation values close to the previous ones.
            samples.append(pose_io.closer(pose, modes, samples[-1]) if samples else pose)
            baked.far.update(far)
            yield (number + 1) / len(times)
        for group, own_times in zip(groups, wanted, strict=True):
            values = np.array(samples)[np.searchsorted(times, own_times)]
            for curve, bone, column in zip(group.curves, group.bones, group.columns, strict=True):
                if len(own_times):
                    row = group.rows[bone]
                    _write_keys(curve, group, int(bone), own_times, values[:, row, column])
    return baked


def _times(group: keyed_poses.Group, step: int) -> np.ndarray:
    """Returns the times of the keys that a group's bones get, float32: the frames, and the artist's keys."""
    keys, outside = group.times, []
    if len(keys) < 2:
        return np.empty(0, np.float32)
    if any(map(_extrapolates, group.curves)):
        # A curve with linear extrapolation takes its slope from the last two keys.
        outside = [keys[0] - 1.0, keys[-1] + 1.0]
    frames = np.arange(np.ceil(keys[0]), np.floor(keys[-1]) + 1, step)
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
    points.clear()
    points.add(len(times))

    def choose(name: str, where: np.ndarray | bool, choice: str, otherwise: str) -> None:
        values = np.where(where, actions.key_value(name, choice), actions.key_value(name, otherwise))
        points.foreach_set(name, np.broadcast_to(values, len(times)).astype(np.int32))

    points.foreach_set("co", np.column_stack([times, values]).astype(np.float32).ravel())
    key = np.maximum(np.searchsorted(group.times, times, side="right") - 1, 0)
    choose(
        "interpolation", group.still[key, bone] & (times >= group.times[0]), "CONSTANT", otherwise="LINEAR"
    )
    choose("type", np.isin(times, group.times), "KEYFRAME", otherwise="BREAKDOWN")
    for side in ("handle_left_type", "handle_right_type"):
        choose(side, True, "AUTO_CLAMPED", otherwise="AUTO_CLAMPED")
    curve.update()
