# SPDX-License-Identifier: GPL-3.0-or-later
"""The keyed poses of an action, and an armature's pose between them."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import NamedTuple

import bpy
import numpy as np

from ...io import actions, pose_io
from ...io.poses import Poses
from . import interpolation


@dataclass
class Group:
    """Bones that have keys at the same times.

    times           [keys]
    rows, modes     [bones], their index in the pose, and their rotation mode
    keyed           [bones, 10], the channels that have curves
    curves          their curves
    bones, columns  [curves], the channel that each moves, as indices of `keyed`
    still           [keys, bones], whether a bone holds its pose until the next key
    gains           [2], how much the channels [bones, 10] increase in a cycle of the keys, before the first
                    and after the last; None where the keys do not repeat
    poses           [bones, 10] of some keys, by index; channels without curves are 0
    """

    times: np.ndarray
    rows: np.ndarray
    modes: np.ndarray
    keyed: np.ndarray
    curves: list[bpy.types.FCurve]
    bones: np.ndarray
    columns: np.ndarray
    still: np.ndarray
    gains: list[np.ndarray | None]
    poses: dict[int, np.ndarray] = field(default_factory=dict)


@dataclass
class Span:
    """The position of a time in a group.

    keys    the indices of four keys; the time is between the second and the third
    rounds  the cycle that each key belongs to
    time    moved by whole cycles to the first one
    times   of the four keys, moved by the same amount
    """

    keys: tuple[int, int, int, int]
    rounds: tuple[int, int, int, int]
    time: float
    times: np.ndarray


def read(
    armature: bpy.types.Object, only: Collection[str] | None = None
) -> tuple[list[Group], dict[str, str]]:
    """Reads the keyed poses of the action that an armature plays, of all bones or only of some; valid until
    the action changes. Returns also the bones that keep their curves, each with the reason."""
    action, slot = actions.playing(armature)
    rotations = pose_io.rotation_properties(armature.pose.bones)
    rows = {name: row for row, name in enumerate(rotations)}
    found: dict[object, list[_Bone]] = {}
    left = {}
    for name, pairs in actions.bone_curves(action, slot, muted=False).items():
        pairs = [pair for pair in pairs if actions.plays(pair[1], rotations.get(name))]
        if not pairs or (only is not None and name not in only):
            continue
        curves = [curve for curve, _channel in pairs]
        reason = actions.reason_against(curves)
        if reason is not None:
            left[name] = reason
            continue
        times, mode = actions.key_times(curves), armature.pose.bones[name].rotation_mode
        gains = [actions.gains_of_a_round(curves, times, onwards) for onwards in (False, True)]
        bone = _Bone(rows[name], mode, pairs, times, actions.hold_still(curves, times), gains)
        # Bones of one group have keys at the same times, which repeat alike.
        likeness = times.tobytes(), *(gain is None for gain in gains)
        found.setdefault(likeness, []).append(bone)
    return [_group(bones) for bones in found.values()], left


class _Bone(NamedTuple):
    """A bone of a group; `gains` [2] of its curves, before the first key and after the last."""

    row: int
    mode: str
    pairs: list[tuple[bpy.types.FCurve, actions.Channel]]
    times: np.ndarray
    still: np.ndarray
    gains: list[np.ndarray | None]


def _group(bones: list[_Bone]) -> Group:
    owners = [number for number, bone in enumerate(bones) for _pair in bone.pairs]
    columns = [channel.column for bone in bones for _curve, channel in bone.pairs]
    keyed = np.zeros((len(bones), pose_io.CHANNELS), dtype=bool)
    keyed[owners, columns] = True
    gains = []
    for side in (0, 1):
        gains.append(None)
        if bones[0].gains[side] is not None:
            gains[side] = np.zeros(keyed.shape)
            gains[side][owners, columns] = np.concatenate([bone.gains[side] for bone in bones])
    return Group(
        times=bones[0].times.astype(np.float64),
        rows=np.array([bone.row for bone in bones]),
        modes=np.array([bone.mode for bone in bones]),
        keyed=keyed,
        curves=[curve for bone in bones for curve, _channel in bone.pairs],
        bones=np.array(owners),
        columns=np.array(columns),
        still=np.array([bone.still for bone in bones]).T,
        gains=gains,
    )


def pose_at(
    armature: bpy.types.Object, groups: list[Group], time: float, method: str, path: str
) -> tuple[np.ndarray, list[str]]:
    """Returns the pose at `time`, float32 [bones, 10], as from pose_io.read_channels(); at keys, and before
    the first and after the last, that of Blender's curves. Returns also the bones whose keys are too far
    apart: the method does not define a unique result, or the angles mean a longer way than it takes.

    groups  from read()
    method  of interpolation.METHODS
    """
    channels, far = pose_io.read_channels(armature.pose.bones), []
    names = armature.pose.bones.keys()
    for group in groups:
        values = [curve.evaluate(time) for curve in group.curves]
        channels[group.rows[group.bones], group.columns] = values
        span = span_at(group, time)
        if span is not None:
            found, is_far = _between(group, span, channels[group.rows], method, path)
            channels[group.rows] = np.where(group.keyed, found, channels[group.rows])
            far += [names[row] for row in group.rows[is_far]]
    return channels, far


def span_at(group: Group, time: float) -> Span | None:
    """Returns the position of `time` among the keys; None at a key, and outside of them where they do not
    repeat."""
    times = group.times
    first, count = times[0], len(times)
    length = times[-1] - first
    if length == 0.0:
        return None
    here = 0 if first <= time <= times[-1] else int(np.floor((time - first) / length))
    if here and group.gains[here > 0] is None:
        return None
    time = time - here * length
    after = int(np.searchsorted(times, time, side="right"))
    if after == count or times[after - 1] == time:
        return None
    keys, rounds = [max(after - 2, 0), after - 1, after, min(after + 1, count - 1)], [here] * 4
    # Across the seam of a repetition, the neighbouring key belongs to another cycle.
    if after == 1 and _repeats(group, here - 1):
        keys[0], rounds[0] = count - 2, here - 1
    if after == count - 1 and _repeats(group, here + 1):
        keys[3], rounds[3] = 1, here + 1
    moved = times[keys] + length * (np.array(rounds) - here)
    return Span(tuple(keys), tuple(rounds), time, moved)


def _repeats(group: Group, number: int) -> bool:
    return number == 0 or group.gains[number > 0] is not None


def _between(
    group: Group, span: Span, now: np.ndarray, method: str, path: str
) -> tuple[np.ndarray, np.ndarray]:
    """float64 [bones, 10], and which bones rotate too far, [bones]; `now` [bones, 10] is Blender's pose."""
    # A channel without keys has its current value at all of them.
    keys = np.stack(
        [
            np.where(group.keyed, _channels_at(group, key, number), now)
            for key, number in zip(span.keys, span.rounds, strict=True)
        ]
    )
    if path == interpolation.STRAIGHT:
        a, b = _poses(group, keys[1]), _poses(group, keys[2])
        found = interpolation.straight(
            a, b, interpolation.progress(now.astype(np.float64), keys[1], keys[2]), method
        )
    else:
        rigid, scale = zip(*(_poses(group, key) for key in keys), strict=True)
        poses = Poses(np.stack(rigid), np.stack(scale))
        found = interpolation.on_spline(poses, span.times, span.time, method)
    channels = pose_io.channels_of(found.poses, group.modes, near=keys[1])
    if path == interpolation.SPLINE:
        channels = np.where(group.still[span.keys[1]][:, None], keys[1], channels)
    # Angles say how far they mean to rotate; quaternions do not. The method takes the shorter way.
    angles = np.abs(keys[2] - keys[1])[:, 3:7].max(axis=1)
    return channels, ~found.is_defined | ((group.modes != "QUATERNION") & (angles > np.pi + 1e-4))


def _channels_at(group: Group, key: int, number_of_round: int) -> np.ndarray:
    """float64 [bones, 10]: the channels at a key, in a cycle of the keys."""
    channels = group.poses.get(key)
    if channels is None:
        channels = group.poses[key] = np.zeros(group.keyed.shape)
        time = float(group.times[key])
        channels[group.bones, group.columns] = [curve.evaluate(time) for curve in group.curves]
    if number_of_round == 0:
        return channels
    return channels + number_of_round * group.gains[number_of_round > 0]


def _poses(group: Group, channels: np.ndarray) -> Poses:
    """Converts channels to poses. Channels without keys are left out: otherwise a bone that is only rotated
    would swing around the position where it was moved by hand."""
    poses = pose_io.poses_of(channels, group.modes)
    poses.rigid[~group.keyed[:, 3:7].any(axis=1), :4] = (1.0, 0.0, 0.0, 0.0)
    poses.rigid[~group.keyed[:, :3].any(axis=1), 4:] = 0.0
    return poses
