# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes in-betweens to plain keys in a separate action, which plays without Sinew."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.errors import SinewError
from ...core.inbetween import BLENDER, METHODS
from ...io import actions, pose_io
from . import inbetween, keyed_poses


@dataclass
class Baked:
    """The new action, the number of bones with new keys, and the bones of `keyed_poses.Pose.far`."""

    action: bpy.types.Action
    bones: int
    far: set[str]


def bake(
    armature: bpy.types.Object, step: int = 1, progress: Callable[[float], None] = lambda _part: None
) -> Baked:
    """Copies the action that Sinew plays on `armature`, with keys at every `step` frames between its first
    and last key and linear interpolation, and plays the copy with Blender's curves.

    The keyed poses stay, also those between whole frames; in-betweens are keys of type Breakdown. The old
    action stays in the file.

    progress  called with the progress, 0 to 1

    Raises SinewError where Sinew makes no in-betweens.
    """
    action, slot = inbetween.action_of(armature)
    poses = keyed_poses.read(armature)
    if not poses.groups or not inbetween.is_on(armature):
        raise SinewError(
            inbetween.obstacle(armature)
            or f"{armature.name}: Sinew makes no in-betweens here; choose a method and key some poses"
        )
    curves = actions.all_curves(action, slot)
    wanted = [_times(group, curves, step) for group in poses.groups]
    times = np.unique(np.concatenate(wanted))
    samples, far = _sample(armature, poses, times, progress)

    baked = action.copy()
    baked.name = f"{action.name} {METHODS[armature.sinew_inbetween].label}"
    for name in [record.name for record in baked.sinew_holds]:
        actions.release(baked, int(name))
    handle = actions.handle_of(slot)
    baked_slot = next((s for s in getattr(baked, "slots", ()) if s.handle == handle), None)
    copies = actions.all_curves(baked, baked_slot)
    for group, own_times in zip(poses.groups, wanted, strict=True):
        values = samples[np.searchsorted(times, own_times)]
        for number, bone, column in zip(group.curves, group.bones, group.columns, strict=True):
            _write_keys(copies[number], group, int(bone), own_times, values[:, group.rows[bone], column])
    if action.is_editable:
        action.use_fake_user = True
    armature.animation_data.action = baked
    if baked_slot is not None:
        armature.animation_data.action_slot = baked_slot
    armature.sinew_inbetween = BLENDER
    return Baked(baked, sum(len(group.rows) for group in poses.groups), far)


def _times(group: keyed_poses.Group, curves: Sequence[bpy.types.FCurve], step: int) -> np.ndarray:
    """Returns the times of the keys that a group's bones get, float32: the frames, and the artist's keys."""
    first, last = group.times[0], group.times[-1]
    frames = np.arange(np.ceil(first), np.floor(last) + 1, step)
    # A curve with linear extrapolation takes its slope from the last two keys.
    outside = [first - 1.0, last + 1.0] if any(_extrapolates(curves[n]) for n in group.curves) else []
    return np.unique(np.concatenate([group.times, frames, outside]).astype(np.float32))


def _extrapolates(curve: bpy.types.FCurve) -> bool:
    return curve.extrapolation == "LINEAR" and all(modifier.mute for modifier in curve.modifiers)


def _sample(
    armature: bpy.types.Object,
    poses: keyed_poses.KeyedPoses,
    times: np.ndarray,
    progress: Callable[[float], None],
) -> tuple[np.ndarray, set[str]]:
    """float32 [times, bones, 10]: the channels at each time, with rotation values close to the previous ones;
    and the bones that rotate too far between keys somewhere."""
    method, path = armature.sinew_inbetween, armature.sinew_inbetween_path
    modes = np.array([bone.rotation_mode for bone in armature.pose.bones])
    samples, far = [], set()
    for number, time in enumerate(times):
        pose = keyed_poses.pose_at(armature, poses, float(time), method, path)
        samples.append(pose_io.closer(pose.channels, modes, samples[-1]) if samples else pose.channels)
        far.update(pose.far)
        progress((number + 1) / len(times))
    return np.stack(samples), far


def _write_keys(
    curve: bpy.types.FCurve, group: keyed_poses.Group, bone: int, times: np.ndarray, values: np.ndarray
) -> None:
    inside = (times >= group.times[0]) & (times <= group.times[-1])
    chosen = inside | _extrapolates(curve)
    times, values = times[chosen], values[chosen]
    points = curve.keyframe_points
    points.clear()
    points.add(len(times))
    points.foreach_set("co", np.column_stack([times, values]).astype(np.float32).ravel())

    def choose(name: str, where: np.ndarray, choice: str, otherwise: str) -> None:
        numbers = np.where(where, actions.key_value(name, choice), actions.key_value(name, otherwise))
        points.foreach_set(name, numbers.astype(np.int32))

    key = np.maximum(np.searchsorted(group.times, times, side="right") - 1, 0)
    choose(
        "interpolation", group.still[key, bone] & (times >= group.times[0]), "CONSTANT", otherwise="LINEAR"
    )
    choose("type", np.isin(times, group.times), "KEYFRAME", otherwise="BREAKDOWN")
    for side in ("handle_left_type", "handle_right_type"):
        choose(side, np.ones(len(times), dtype=bool), "AUTO_CLAMPED", otherwise="AUTO_CLAMPED")
    curve.update()
