# SPDX-License-Identifier: GPL-3.0-or-later
"""An armature object's choice of in-betweens, stored in the .blend file, and whether it is possible."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bpy

from ...attach import properties
from ...core import inbetween as core
from ...core.inbetween import BLENDER
from ...io import actions


class Listener:
    """The function that reacts to another choice; set on registration, as it also reads the choice."""

    changed: Callable[[bpy.types.Object, bpy.types.Context], None] | None = None


def _changed(armature: bpy.types.Object, context: bpy.types.Context) -> None:
    if Listener.changed is not None:
        Listener.changed(armature, context)


# On objects themselves, as a library override loses a group that the linked file does not have when it is
# saved (Blender 5.0 and 5.2).
_PROPERTIES = {
    "sinew_inbetween": bpy.props.EnumProperty(
        name="In-betweens",
        description="How the bones move between the keyed poses of the action",
        items=[
            (core.BLENDER, "Blender's Curves", "Each channel by its own curve, as without Sinew", 0),
            *((m.name, m.label, m.description, m.number) for m in core.METHODS.values()),
        ],
        default=core.BLENDER,
        options=set(),
        override=properties.OVERRIDABLE,
        update=_changed,
    ),
    "sinew_inbetween_path": bpy.props.EnumProperty(
        name="Path",
        description="Which keyed poses shape the way from one to the next",
        items=[
            (
                core.STRAIGHT,
                "Key to Key",
                "The two neighbours, at the pace of the keys' own interpolation",
                0,
            ),
            (
                core.SPLINE,
                "Spline",
                "Catmull-Rom through four keyed poses: smooth at keys, at the spline's pace",
                1,
            ),
        ],
        default=core.STRAIGHT,
        options=set(),
        override=properties.OVERRIDABLE,
        update=_changed,
    ),
}


def register() -> None:
    for name, choice in _PROPERTIES.items():
        setattr(bpy.types.Object, name, choice)


def unregister() -> None:
    for name in _PROPERTIES:
        delattr(bpy.types.Object, name)


def is_on(armature: bpy.types.Object) -> bool:
    return armature.type == "ARMATURE" and armature.sinew_inbetween != BLENDER


def action_of(armature: bpy.types.Object) -> tuple[bpy.types.Action | None, bpy.types.bpy_struct | None]:
    """Returns the action that an armature object plays, and its slot."""
    animation = armature.animation_data
    if animation is None or animation.action is None:
        return None, None
    return animation.action, actions.slot_of(animation)


def obstacle(armature: bpy.types.Object) -> str | None:
    """Returns why Blender's own curves play although a method is chosen, in one sentence; None where nothing
    prevents it."""
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
