# SPDX-License-Identifier: GPL-3.0-or-later
"""What an armature object has chosen for its in-betweens, and whether it can have it."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...core.inbetween import BLENDER
from ...io import actions


def is_on(armature: bpy.types.Object) -> bool:
    return armature.type == "ARMATURE" and armature.sinew_inbetween != BLENDER


def action_of(armature: bpy.types.Object) -> tuple[bpy.types.Action | None, bpy.types.bpy_struct | None]:
    """The action that an armature object plays, and its slot."""
    animation = armature.animation_data
    if animation is None or animation.action is None:
        return None, None
    return animation.action, actions.slot_of(animation)


def obstacle(armature: bpy.types.Object) -> str | None:
    """Why Blender's own curves play although a method is chosen, in one sentence; None where nothing is in
    the way."""
    animation, (action, slot) = armature.animation_data, action_of(armature)
    if animation is None or action is None:
        return None
    if animation.use_tweak_mode:
        return f"{armature.name} is tweaking an NLA strip: Blender's curves play; leave tweak mode (Tab)"
    playing = _strips_that_play(animation)
    if playing:
        return (
            f"{armature.name} plays NLA strips ({playing[0].name}): Blender's curves play; mute the tracks, "
            "or bake them into one action (Object > Animation > Bake Action)"
        )
    if len(getattr(action, "layers", ())) > 1 or any(len(layer.strips) > 1 for layer in _layers(action)):
        return f"{action.name} has several layers: Blender's curves play; merge them"
    for other in bpy.data.objects:
        for strip in _strips_that_play(other.animation_data) if other.animation_data else ():
            if strip.action == action and actions.slot_of(strip) == slot:
                return (
                    f"{action.name} is also played by an NLA strip of {other.name}: Blender's curves play; "
                    "make the action single-user"
                )
    return None


def _layers(action: bpy.types.Action) -> Sequence[bpy.types.bpy_struct]:
    return getattr(action, "layers", ())


def _strips_that_play(animation: bpy.types.AnimData) -> list[bpy.types.NlaStrip]:
    if not animation.use_nla:
        return []
    solo = [track for track in animation.nla_tracks if track.is_solo]
    tracks = solo or [track for track in animation.nla_tracks if not track.mute]
    return [strip for track in tracks for strip in track.strips if not strip.mute]
