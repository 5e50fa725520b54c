# SPDX-License-Identifier: GPL-3.0-or-later
"""Has an armature play a copy of its action, which plays without Sinew; and restores the original, and the
pose that it did not key."""

import json
from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...base.errors import SinewError
from ...io import actions, pose_io


class SinewActionCopy(bpy.types.PropertyGroup):
    """Of an action: what it replaced, see restore(). A library override would lose it on the object; a copy
    of the copy has the same original."""

    is_on: bpy.props.BoolProperty(description="Whether it is a copy with keys of Sinew")
    original: bpy.props.PointerProperty(type=bpy.types.Action, description="The action before")
    # JSON: channels by bone, as from pose_io.read_channels().
    channels: bpy.props.StringProperty(description="The pose before")


def is_on(armature: bpy.types.Object) -> bool:
    """Whether the armature plays a copy with keys of Sinew."""
    action = actions.playing(armature)[0]
    return action is not None and action.is_property_set("sinew_copy") and action.sinew_copy.is_on


def check(armature: bpy.types.Object) -> None:
    """Raises SinewError where no copy of the action can be keyed."""
    if not armature.is_editable:
        raise SinewError(
            f"{armature.name} is linked: make a library override first (Object > Library Override)"
        )
    animation = armature.animation_data
    if animation is None:
        return
    if animation.action_blend_type != "REPLACE" or animation.action_influence != 1.0:
        raise SinewError(
            f"{armature.name}: its action is mixed with NLA strips; set its blending to Replace and its "
            "influence to 1, or bake the strips into one action (Object > Animation > Bake Action)"
        )
    if animation.use_tweak_mode:
        raise SinewError(f"{armature.name} is tweaking an NLA strip: leave tweak mode first (Tab)")
    layers = getattr(animation.action, "layers", ())
    if len(layers) > 1 or any(len(layer.strips) > 1 for layer in layers):
        raise SinewError(f"{animation.action.name} has several layers: merge them first")


@contextmanager
def playing(armature: bpy.types.Object, suffix: str) -> Iterator[None]:
    """Context in which the armature plays a copy of its action, to be keyed; without an action, the first key
    makes one. After an error, and where the context is left before its end, everything is as before.
    """
    check(armature)
    was_on = is_on(armature)
    action, slot = actions.playing(armature)
    handle = actions.handle_of(slot)
    channels = pose_io.read_channels(armature.pose.bones)
    try:
        if action is not None:
            copy = action.copy()
            copy.name = f"{action.name} {suffix}"
            _play(armature, copy, handle)
        yield
    except BaseException:
        made = actions.playing(armature)[0]
        _play(armature, action, handle)
        if made is not None and made != action:
            bpy.data.actions.remove(made)
        pose_io.write_channels(armature.pose.bones, channels)
        raise
    if not was_on:
        record = actions.playing(armature)[0].sinew_copy
        record.is_on, record.original = True, action
        record.channels = json.dumps(
            {bone.name: row for bone, row in zip(armature.pose.bones, channels.tolist(), strict=True)}
        )
        if action is not None and action.is_editable:
            action.use_fake_user = True
    elif not action.users:
        bpy.data.actions.remove(action)


def restore(armature: bpy.types.Object) -> None:
    """Restores what playing() replaced: the action, and the poses that it did not key."""
    copy, slot = actions.playing(armature)
    record = copy.sinew_copy
    saved = json.loads(record.channels)
    _play(armature, record.original, actions.handle_of(slot))
    channels = pose_io.read_channels(armature.pose.bones)
    for row, bone in enumerate(armature.pose.bones):
        if bone.name in saved:
            channels[row] = saved[bone.name]
    pose_io.write_channels(armature.pose.bones, channels)
    if not copy.users:
        bpy.data.actions.remove(copy)


def _play(armature: bpy.types.Object, action: bpy.types.Action | None, handle: int) -> None:
    if armature.animation_data is not None:
        actions.play_by_handle(armature.animation_data, action, handle)
