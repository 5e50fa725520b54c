# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of frames as shape keys with keyed values and linear interpolation."""

from collections.abc import Sequence

import bpy
import numpy as np

from ...io import actions
from . import baked_files


def add(obj: bpy.types.Object, frames: Sequence[float], shapes: Sequence[np.ndarray]) -> None:
    """Adds a shape key, float32 [vertices, 3], for each frame to an object whose mesh has none; each is fully
    on at its frame, with linear interpolation between frames.

    frames  of the scene

    Keys are relative, with keyed values, as glTF, FBX and other programs do not support absolute keys.
    """
    obj.shape_key_add(name="Basis", from_mix=False)
    ramps = baked_files.ramps(key_times(frames))
    for frame, shape, (times, values) in zip(frames, shapes, ramps, strict=True):
        block = obj.shape_key_add(name=f"Frame {frame:g}", from_mix=False)
        block.points.foreach_set("co", shape.ravel())
        for time, value in zip(times, values, strict=True):
            block.value = value
            block.keyframe_insert("value", frame=time)
    make_straight(obj.data.shape_keys)


def key_times(frames: Sequence[float]) -> list[float]:
    """Converts frames of the scene to times in animation and caches, which the scene's time remapping
    stretches."""
    render = bpy.context.scene.render
    if render.frame_map_old == render.frame_map_new:
        return list(frames)
    return [frame * render.frame_map_old / render.frame_map_new for frame in frames]


def make_straight(owner: bpy.types.ID, path: str | None = None) -> None:
    """Sets linear interpolation between the keys of an owner's curves, all or those of `path`."""
    animation = owner.animation_data
    for curve in actions.all_curves(animation.action, actions.slot_of(animation)):
        if path is None or curve.data_path == path:
            kinds = np.full(
                len(curve.keyframe_points), actions.key_value("interpolation", "LINEAR"), np.int32
            )
            curve.keyframe_points.foreach_set("interpolation", kinds)
            curve.update()
