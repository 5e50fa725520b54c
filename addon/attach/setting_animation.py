# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys and drivers of Sinew's own settings."""

from collections.abc import Iterable

import bpy

from ..io import actions
from ..io.actions import players
from . import pose_driver, properties


def remove_keys(obj: bpy.types.Object, path: str = "sinew.") -> None:
    """Removes keys of Sinew's settings from the object, unless another object with Sinew plays them, too."""
    animation = obj.animation_data
    if animation is None:
        return
    for player in players(animation):
        action = player.action
        if action is None or (action.users > 1 and _others_need(obj, player)):
            continue
        removed = 0
        for curves in actions.curve_lists(action, actions.slot_of(player)):
            for curve in [c for c in curves if c.data_path.startswith(path)]:
                curves.remove(curve)
                removed += 1
        curves_now = actions.curve_lists(action, actions.slot_of(player))
        if removed and player is animation and not any(len(curves) for curves in curves_now):
            animation.action = None
            if not action.users:
                bpy.data.actions.remove(action)


def keyed(obj: bpy.types.Object, names: Iterable[str]) -> str:
    """Returns the first of the settings that the object's animation has keys of, or none."""
    animation = obj.animation_data
    paths = {
        curve.data_path
        for player in (players(animation) if animation is not None else ())
        if player.action is not None
        for curves in actions.curve_lists(player.action, actions.slot_of(player))
        for curve in curves
    }
    return next((name for name in names if f"sinew.{name}" in paths), "")


def _others_need(obj: bpy.types.Object, player: bpy.types.AnimData | bpy.types.NlaStrip) -> bool:
    """Whether another object with Sinew plays the same curves, as a linked duplicate does."""
    played = (player.action, actions.slot_of(player))
    others = (o for o in bpy.data.objects if o != obj and o.animation_data and properties.has_sinew(o))
    return any((p.action, actions.slot_of(p)) == played for o in others for p in players(o.animation_data))


def remove(obj: bpy.types.Object) -> None:
    """Removes keys and drivers of Sinew's settings from the object, and its animation data if nothing else
    was in it."""
    remove_keys(obj)
    animation = obj.animation_data
    if animation is None:
        return
    for driver in [d for d in animation.drivers if d.data_path.startswith("sinew.")]:
        animation.drivers.remove(driver)
    pose_driver.remove_empty_animation(obj)
