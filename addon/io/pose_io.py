# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes pose bones' location, rotation and scale, in any rotation mode."""

import bpy
import numpy as np
import sinew
from mathutils import Euler, Quaternion

from ..skinning.arrays import read
from .poses import Poses

CHANNELS = 10

ROTATION_PROPERTIES = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}


def rotation_properties(bones: bpy.types.bpy_prop_collection) -> dict[str, str]:
    """Returns, by name, each pose bone's rotation property that is in use."""
    return {bone.name: ROTATION_PROPERTIES.get(bone.rotation_mode, "rotation_euler") for bone in bones}


def read_channels(bones: bpy.types.bpy_prop_collection) -> np.ndarray:
    """Returns float32 [bones, 10] as set on the pose bones: location 3, rotation 4 (Euler angles: 3 and a 0),
    scale 3."""
    channels = np.zeros((len(bones), CHANNELS), dtype=np.float32)
    for name, columns, rows in _channel_blocks(bones):
        channels[rows, columns] = read(bones, name, columns.stop - columns.start)[rows]
    return channels


def write_channels(bones: bpy.types.bpy_prop_collection, channels: np.ndarray) -> bool:
    """Sets what differs from `channels`, as from read_channels(). Returns whether anything did."""
    changed = False
    for name, columns, rows in _channel_blocks(bones):
        values = read(bones, name, columns.stop - columns.start)
        if not np.array_equal(values[rows], channels[rows, columns]):
            values[rows] = channels[rows, columns]
            bones.foreach_set(name, values.ravel())
            changed = True
    return changed


def _channel_blocks(
    bones: bpy.types.bpy_prop_collection,
) -> list[tuple[str, slice, np.ndarray]]:
    """Returns each property of the channels, its columns and the bones (rows) that use it."""
    rotations = np.array(list(rotation_properties(bones).values()))
    everything = np.ones(len(bones), dtype=bool)
    blocks = [("location", slice(0, 3), everything), ("scale", slice(7, 10), everything)]
    for name in np.unique(rotations):
        width = 3 if name == "rotation_euler" else 4
        blocks.append((str(name), slice(3, 3 + width), rotations == name))
    return blocks


def poses_of(channels: np.ndarray, modes: np.ndarray) -> Poses:
    """Returns bones' transforms relative to rest, from channels [bones, 10] in rotation `modes` [bones]. A
    quaternion or an axis of length 0 means no rotation."""
    rigid = np.empty((len(channels), 7))
    for mode in np.unique(modes):
        rows = modes == mode
        rigid[rows, :4] = _quaternions(channels[rows, 3:7], str(mode))
    rigid[:, 4:] = channels[:, :3]
    return Poses(rigid, channels[:, 7:].astype(np.float64))


def channels_of(poses: Poses, modes: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The inverse of poses_of(), float64 [bones, 10]; of equivalent rotation values it takes those closest to
    `near`."""
    channels = np.zeros((len(modes), CHANNELS))
    channels[:, :3], channels[:, 7:] = poses.rigid[:, 4:], poses.scale
    for mode in np.unique(modes):
        rows = modes == mode
        rotations = _rotations(poses.rigid[rows, :4], str(mode), near[rows, 3:7])
        channels[rows, 3 : 3 + rotations.shape[1]] = rotations
    return channels


def closer(channels: np.ndarray, modes: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Returns `channels`, where rotation values far from `near` are replaced by equivalent ones: the
    antipodal quaternion, or angles without the full turns between them."""
    quaternions = modes == "QUATERNION"
    against = (channels[:, 3:7] * near[:, 3:7]).sum(axis=1) < 0.0
    turned = np.abs(channels[:, 3:7] - near[:, 3:7]).max(axis=1) > np.pi
    far = np.where(quaternions, against, turned)[:, None]
    return np.where(far, channels_of(poses_of(channels, modes), modes, near), channels)


def _quaternions(rotations: np.ndarray, mode: str) -> np.ndarray:
    if mode not in ROTATION_PROPERTIES:
        return np.array(
            [Euler(angles, mode).to_quaternion() for angles in rotations[:, :3]], dtype=np.float64
        )
    rotations = rotations.astype(np.float64)
    if mode == "QUATERNION":
        return sinew.quat_vec.normalized(_pairs(rotations))[:, :4]
    return sinew.quat_vec.from_axis_angle(rotations[:, 1:], rotations[:, 0])[:, :4]


def _rotations(quaternions: np.ndarray, mode: str, near: np.ndarray) -> np.ndarray:
    if mode not in ROTATION_PROPERTIES:
        return np.array(
            [
                Quaternion(quaternion).to_euler(mode, Euler(angles, mode))
                for quaternion, angles in zip(quaternions, near[:, :3], strict=True)
            ]
        )
    if mode == "QUATERNION":
        return np.where((quaternions * near).sum(axis=1, keepdims=True) < 0.0, -quaternions, quaternions)
    screw = sinew.quat_vec.to_screw(_pairs(quaternions))
    # A rotation has two equivalent axes: take the one closer to the axis that is set.
    signs = np.where((screw.axis * near[:, 1:]).sum(axis=1) < 0.0, -1.0, 1.0)
    angles = signs * screw.angle
    rounds = np.round((near[:, 0] - angles) / (2.0 * np.pi))
    # The identity can have any axis: keep the one that is set.
    axes = np.where(screw.angle[:, None] > 0.0, signs[:, None] * screw.axis, near[:, 1:])
    return np.column_stack([angles + 2.0 * np.pi * rounds, _unit(axes, otherwise=(0.0, 1.0, 0.0))])


def _pairs(quaternions: np.ndarray) -> np.ndarray:
    """Returns [n, 7], as sinew.quat_vec takes them, without translation."""
    return np.pad(quaternions, ((0, 0), (0, 3)))


def _unit(vectors: np.ndarray, otherwise: tuple[float, ...]) -> np.ndarray:
    """Returns each row normalised; `otherwise` in place of a row of length 0."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(
        vectors, lengths, out=np.broadcast_to(otherwise, vectors.shape).copy(), where=lengths > 0.0
    )
