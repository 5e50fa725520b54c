# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's events for in-betweens: poses the bones before each frame is evaluated.

Blender evaluates constraints, drivers and everything else that follows the bones after `frame_change_pre`,
for the same frame; it calls that at the sub-frames of a motion-blurred render, too.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...core.inbetween import BLENDER
from ...deform import events, originals
from ...deform.session import objects_now
from ...io import actions, pose_io
from . import inbetween, keyed_poses

log = logging.getLogger("sinew")


@dataclass
class Player:
    """An armature whose action is held, and its last pose.

    left   bones that Blender's curves play, each with the reason
    keyed  its keyed poses, None where they may have changed
    """

    armature: bpy.types.Object
    left: dict[str, str]
    time: float | None = None
    keyed: keyed_poses.KeyedPoses | None = None
    pose: keyed_poses.Pose | None = None

    @property
    def bones(self) -> int:
        """The number of bones that Sinew plays."""
        return sum(len(group.rows) for group in self.keyed.groups) if self.keyed is not None else 0


@dataclass
class Session:
    """Which armatures play what in the open file; made again whenever it may be out of date.

    players  by session_uid: the armatures that play a held action, also those that only share it
    stamps   what to compare for these, and for those that wait for an action, to notice changes
    errors   of armatures that are left to Blender because playing them failed
    """

    players: dict[int, Player] | None = None
    stamps: list[tuple[bpy.types.Object, tuple]] = field(default_factory=list)
    objects_seen: tuple[int, int] = (0, 0)
    errors: dict[int, str] = field(default_factory=dict)
    updating: bool = False

    @property
    def idle(self) -> bool:
        """Nothing is on, and no object has been added since that was found."""
        return self.players == {} and not self.stamps and self.objects_seen == objects_now()

    @property
    def outdated(self) -> bool:
        return (
            self.players is None
            or self.objects_seen != objects_now()
            or any(_stamp(armature) != stamp for armature, stamp in self.stamps)
        )

    def forget(self) -> None:
        self.players = None
        self.stamps = []
        self.errors = {}
        subscribe_to_frames()


session = Session()


def player_of(armature: bpy.types.Object) -> Player | None:
    """Returns what the panel shows of an armature; None where Blender's curves play."""
    return (session.players or {}).get(armature.session_uid)


def problem_of(armature: bpy.types.Object) -> str | None:
    """Returns why Blender's curves play although a method is chosen, in one sentence."""
    return session.errors.get(armature.session_uid) or inbetween.obstacle(armature)


def refresh(scene: bpy.types.Scene) -> None:
    """Holds the slots that have to be held, and poses all bones for the scene's frame."""

    def work() -> None:
        _settle()
        _play(scene)

    _guarded(work)
    _subscribe_to_needed_frames()


def release_all() -> None:
    """Restores all curves as the artist had them, until the next refresh()."""
    _release()
    session.players = None


def _guarded(work: Callable[[], None]) -> None:
    # Sinew's own writing causes another update.
    if session.updating:
        return
    session.updating = True
    try:
        work()
    except ReferenceError:
        # It was deleted since the list was made.
        session.players = None
    finally:
        session.updating = False


def _settle() -> None:
    """Holds the slots that armatures with a method play, releases all others, and lists who plays what."""
    armatures = [obj for obj in bpy.data.objects if obj.type == "ARMATURE" and obj.pose is not None]
    wanted = {}
    for armature in filter(inbetween.is_on, armatures):
        action, slot = inbetween.action_of(armature)
        failed = armature.session_uid in session.errors
        if action is not None and not failed and inbetween.obstacle(armature) is None:
            wanted.setdefault(_slot_key(action, slot), (action, slot, armature))
    _release(keep=set(wanted))
    left = {
        key: actions.hold(action, slot, pose_io.rotation_properties(armature.pose.bones))
        for key, (action, slot, armature) in wanted.items()
    }
    before, session.players, session.stamps = session.players or {}, {}, []
    for armature in armatures:
        uid, key = armature.session_uid, _slot_key(*inbetween.action_of(armature))
        if key in wanted:
            session.players[uid] = before.get(uid) or Player(armature, {})
            session.players[uid].left, session.players[uid].keyed = left[key], None
        if key in wanted or inbetween.is_on(armature):
            session.stamps.append((armature, _stamp(armature)))
    session.objects_seen = objects_now()


def _release(keep: set[tuple[int, int]] = frozenset()) -> None:
    for action in bpy.data.actions:
        for name in [hold.name for hold in action.sinew_holds]:
            if (action.session_uid, int(name)) not in keep:
                actions.release(action, int(name))


def _slot_key(action: bpy.types.Action | None, slot: bpy.types.bpy_struct | None) -> tuple[int, int] | None:
    return (action.session_uid, actions.handle_of(slot)) if action is not None else None


def _stamp(armature: bpy.types.Object) -> tuple:
    """Changes with everything about an armature that decides who plays its bones."""
    animation = armature.animation_data
    nla = ()
    if animation is not None:
        tracks = tuple((track.mute, track.is_solo, len(track.strips)) for track in animation.nla_tracks)
        nla = (animation.use_nla, animation.use_tweak_mode, tracks)
    rotations = pose_io.rotation_properties(armature.pose.bones)
    return inbetween.is_on(armature), _slot_key(*inbetween.action_of(armature)), nla, rotations


def _play(scene: bpy.types.Scene, acted: set[int] | None = None) -> None:
    """Poses the scene's players for its frame.

    acted  session_uids of actions whose keys may have changed: only bones that this changes are written, as
           bones posed by hand and not keyed yet must stay; None: everything is written
    """
    time = scene.frame_current_final
    for uid, player in list(session.players.items()):
        armature = player.armature
        scenes = armature.users_scene
        action = inbetween.action_of(armature)[0]
        if action is None or (scenes and scene not in scenes):
            continue
        if acted is not None and action.session_uid not in acted and player.pose is not None:
            continue
        try:
            _pose(player, time, everything=acted is None)
        except ReferenceError:
            raise
        except Exception as error:
            message = (
                f"{armature.name}: {type(error).__name__}: {error}; Blender's curves play until a method is "
                "chosen anew"
            )
            log.error("%s", message, exc_info=error)
            session.errors[uid] = message
    if any(uid in session.errors for uid in session.players):
        _settle()


def _pose(player: Player, time: float, everything: bool) -> None:
    armature, before = player.armature, player.pose
    method = armature.sinew_inbetween
    if player.armature.session_uid in session.errors:
        method = BLENDER
    if player.keyed is None or not keyed_poses.fits(player.keyed, armature):
        player.keyed = keyed_poses.read(armature)
    pose = keyed_poses.pose_at(armature, player.keyed, time, method, armature.sinew_inbetween_path)
    channels = pose.channels
    comparable = before is not None and player.time == time and before.channels.shape == channels.shape
    if comparable and not everything:
        changed = before.channels != channels
        channels = np.where(changed, channels, pose_io.read_channels(armature.pose.bones))
    player.pose, player.time = pose, time
    if pose_io.write_channels(armature.pose.bones, channels):
        armature.update_tag(refresh={"DATA"})


def _changed(_armature: bpy.types.Object, context: bpy.types.Context) -> None:
    session.errors = {}
    refresh(context.scene)


def subscribe_to_frames() -> None:
    """Has Blender call before each frame, until it is known that there is nothing to do."""
    events.subscribe(*_BEFORE_FRAMES)


def _subscribe_to_needed_frames() -> None:
    """Subscribes only where something plays: a Python handler takes 3 to 10 us of a frame."""
    if session.idle and events.IMPORTS_ARE_ANNOUNCED:
        events.unsubscribe(*_BEFORE_FRAMES)
    else:
        subscribe_to_frames()


@persistent
def on_frame_change(scene: bpy.types.Scene, *_args: object) -> None:
    if session.idle:
        return

    def work() -> None:
        # Keys that a script set since the last update are not evaluated yet, and there was no event for them.
        layers = [layer.depsgraph for layer in scene.view_layers if layer.depsgraph is not None]
        if session.outdated or any(depsgraph.id_type_updated("ACTION") for depsgraph in layers):
            _settle()
        _play(scene)

    _guarded(work)


@persistent
def on_depsgraph_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if session.idle:
        _subscribe_to_needed_frames()
        return

    def work() -> None:
        changed = [update.id for update in depsgraph.updates]
        original = originals.finder("depsgraph_update_post", on_depsgraph_update)
        found = [original(what) for what in changed if isinstance(what, bpy.types.Action)]
        acted = {action.session_uid for action in found if action is not None}
        structure = None in found or any(
            isinstance(what, bpy.types.Scene | bpy.types.Collection) for what in changed
        )
        if acted or structure or session.outdated:
            _settle()
            _play(scene, acted)

    _guarded(work)
    _subscribe_to_needed_frames()


@persistent
def on_data_replaced(*_args: object) -> None:
    session.forget()


@persistent
def on_data_new(*_args: object) -> None:
    """After undo, redo and loading Blender plays its curves again, so bones are posed again."""
    session.forget()
    refresh(bpy.context.scene)


@persistent
def on_imported(*_args: object) -> None:
    """Importing scripts can change the frame without any other event."""
    subscribe_to_frames()


@persistent
def on_save(*_args: object) -> None:
    """In a saved file the curves are as the artist left them, and play without Sinew."""
    release_all()


@persistent
def on_saved(*_args: object) -> None:
    _guarded(_settle)


_BEFORE_FRAMES = ("frame_change_pre", on_frame_change)
_HANDLERS = {
    "depsgraph_update_post": on_depsgraph_update,
    "undo_pre": on_data_replaced,
    "undo_post": on_data_new,
    "redo_pre": on_data_replaced,
    "redo_post": on_data_new,
    "load_pre": on_data_replaced,
    "load_post": on_data_new,
    "save_pre": on_save,
    "save_post": on_saved,
    "save_post_fail": on_saved,
}
if events.IMPORTS_ARE_ANNOUNCED:
    _HANDLERS["blend_import_post"] = on_imported


def register() -> None:
    session.forget()
    inbetween.Listener.changed = _changed
    events.subscribe_all(_HANDLERS)


def adopt_open_file() -> None:
    """Plays in-betweens in a file that was open before Sinew was registered."""
    if hasattr(bpy.data, "objects") and getattr(bpy.context, "view_layer", None) is not None:
        refresh(bpy.context.scene)


def unregister() -> None:
    release_all()
    session.forget()
    events.unsubscribe_all(_HANDLERS)
    events.unsubscribe(*_BEFORE_FRAMES)
