# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads actions of an armature as clips, and writes clips as actions."""

from collections.abc import Generator

import bpy
import numpy as np
from sinew import affine, quat_vec

from ...base.errors import SinewError
from ...io import actions, pose_io
from ...io.poses import Poses
from .clip import Clip, Rig

# The columns of pose_io.read_channels() at rest, for quaternions.
_REST = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def rig_of(armature: bpy.types.Object) -> Rig:
    """Returns the bones of an armature object, parents first."""
    waiting = [bone for bone in reversed(armature.data.bones) if bone.parent is None]
    bones = []
    while waiting:
        bones.append(waiting.pop())
        waiting += reversed(bones[-1].children)
    if not bones:
        raise SinewError(f"{armature.name} has no bones")
    index = {bone.name: number for number, bone in enumerate(bones)}
    parents = np.array([index[bone.parent.name] if bone.parent else -1 for bone in bones])
    rest = affine.to_quat_vec(
        affine.normalized(np.array([bone.matrix_local for bone in bones], dtype=np.float64))
    )
    above = np.where((parents >= 0)[:, None], rest[np.maximum(parents, 0)], quat_vec.identity())
    return Rig(
        tuple(index),
        parents,
        quat_vec.compose(quat_vec.inverse(above), rest),
        np.array([bone.length for bone in bones]),
    )


def read(
    armature: bpy.types.Object, action: bpy.types.Action, rig: Rig | None = None
) -> Generator[float, None, Clip]:
    """Reads an action's bones at every frame, as the armature would play it; yields the progress, 0 to 1.

    From its first key of a bone to its last, or its manual frame range; it is a cycle where that says so.
    F-curve modifiers apply, constraints and drivers do not. Channels without keys are at rest. Raises
    SinewError where it moves no bone.
    """
    rig = rig_of(armature) if rig is None else rig
    curves = _playing(armature, action)
    if not curves:
        raise SinewError(f"{action.name} moves no bone of {armature.name}: choose another action")
    times = _times(action, [curve for curve, _bone, _column in curves])
    rows = {name: row for row, name in enumerate(rig.names)}
    modes = _modes(armature, rig)
    channels = np.tile(_rest_channels(modes), (len(times), 1, 1))
    for number, (curve, bone, column) in enumerate(curves):
        channels[:, rows[bone], column] = [curve.evaluate(time) for time in times]
        yield (number + 1) / len(curves)
    poses = pose_io.poses_of(channels.reshape(-1, pose_io.CHANNELS), np.tile(modes, len(times)))
    shape = (len(times), len(rig.names), -1)
    is_cyclic = action.use_frame_range and action.use_cyclic
    return Clip(
        action.name,
        rig,
        Poses(poses.rigid.reshape(shape), poses.scale.reshape(shape)),
        float(times[-1] - times[0]),
        is_cyclic,
    )


def keyed_properties(armature: bpy.types.Object, action: bpy.types.Action) -> set[tuple[str, str]]:
    """Returns what an action keys: bones with "location", "rotation" or "scale"."""
    names = ("location",) * 3 + ("rotation",) * 4 + ("scale",) * 3
    return {(bone, names[column]) for _curve, bone, column in _playing(armature, action)}


def write(
    armature: bpy.types.Object, clip: Clip, name: str, first_frame: float, keyed: set[tuple[str, str]]
) -> Generator[float, None, bpy.types.Action]:
    """Makes a new action with keys at every frame and linear interpolation; nothing plays it yet.

    keyed  as from keyed_properties(); whatever is not at rest is keyed as well
    """
    rig, count = clip.rig, len(clip.poses.rigid)
    modes = _modes(armature, rig)
    samples = np.empty((count, len(rig.names), pose_io.CHANNELS))
    near = _rest_channels(modes)
    for frame in range(count):
        poses = Poses(clip.poses.rigid[frame], clip.poses.scale[frame])
        near = samples[frame] = pose_io.channels_of(poses, modes, near)
        yield 0.5 * (frame + 1) / count
    times = first_frame + np.linspace(0.0, clip.length, count)
    rotations = pose_io.rotation_properties(armature.pose.bones)
    action = bpy.data.actions.new(name)
    try:
        curves, _slot = actions.new_curves(action, armature)
        for row, bone in enumerate(rig.names):
            path = f'pose.bones["{bpy.utils.escape_identifier(bone)}"].'
            for kind, columns, at_rest in _kinds(modes[row]):
                values = samples[:, row, columns]
                if (bone, kind) in keyed or np.abs(values - at_rest).max() > 1e-6:
                    for index in range(values.shape[1]):
                        property_name = rotations[bone] if kind == "rotation" else kind
                        curve = actions.new_curve(curves, path + property_name, index, bone)
                        actions.write_keys(curve, times, values[:, index])
            yield 0.5 + 0.5 * (row + 1) / len(rig.names)
    except BaseException:
        # Esc closes the generator.
        bpy.data.actions.remove(action)
        raise
    return action


def _playing(armature: bpy.types.Object, action: bpy.types.Action) -> list[tuple[bpy.types.FCurve, str, int]]:
    """Returns the curves that move the armature's bones, each with the bone and the column of its channel."""
    rotations = pose_io.rotation_properties(armature.pose.bones)
    found = actions.bone_curves(action, actions.slot_for(action, armature), muted=False)
    return [
        (curve, bone, channel.column)
        for bone, pairs in found.items()
        for curve, channel in pairs
        if actions.plays(channel, rotations.get(bone)) and curve.is_valid
    ]


def _times(action: bpy.types.Action, curves: list[bpy.types.FCurve]) -> np.ndarray:
    """Returns even times from first to last, a frame apart; less where that is not a whole number of
    frames."""
    if action.use_frame_range:
        first, last = action.frame_start, action.frame_end
    else:
        ranges = [tuple(curve.range()) for curve in curves]
        first, last = min(start for start, _end in ranges), max(end for _start, end in ranges)
    return np.linspace(first, last, max(round(last - first), 1 if last > first else 0) + 1)


def _modes(armature: bpy.types.Object, rig: Rig) -> np.ndarray:
    return np.array([armature.pose.bones[name].rotation_mode for name in rig.names])


def _rest_channels(modes: np.ndarray) -> np.ndarray:
    """Returns [bones, 10]: channels of bones at rest in their rotation modes."""
    channels = np.tile(_REST, (len(modes), 1))
    channels[modes == "AXIS_ANGLE", 3:7] = (0.0, 0.0, 1.0, 0.0)
    channels[~np.isin(modes, list(pose_io.ROTATION_PROPERTIES)), 3:7] = 0.0
    return channels


def _kinds(mode: str) -> list[tuple[str, slice, np.ndarray]]:
    """Returns each property with its columns, and its values at rest."""
    width = 4 if mode in pose_io.ROTATION_PROPERTIES else 3
    columns = {"location": slice(0, 3), "rotation": slice(3, 3 + width), "scale": slice(7, 10)}
    rest = _rest_channels(np.array([mode]))[0]
    return [(kind, where, rest[where]) for kind, where in columns.items()]
