# SPDX-License-Identifier: GPL-3.0-or-later
"""Attaches and detaches live trees: on changed settings, undo, loading and saving. At a change of frame it
only reports failures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import bpy
from bpy.app.handlers import persistent

from ...attach import references
from ...attach.subscribers import subscribers
from ...attach.updates import is_main_thread, is_rendering_in_window
from ...deform import events, session
from . import ik_in_depsgraph, ik_live


def _armatures() -> Iterator[bpy.types.Object]:
    return filter(ik_live.was_switched_on, bpy.data.objects)


def sync_all() -> None:
    if not _may_change():
        return
    with references.between_steps():
        changed = [ik_live.sync(armature) for armature in list(_armatures())]
        if any(changed):
            _refresh_meshes()


def _refresh_meshes() -> None:
    """Called where constraints have changed: what a handler changes, Blender evaluates without an event, so
    that Sinew would not deform after the update."""
    if any(state.plan.after_update for _obj, state in session.current.pairs):
        session.refresh_between_steps(bpy.context)


@persistent
def on_depsgraph_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not depsgraph.id_type_updated("OBJECT") or not _may_change():
        return
    # By name: another add-on's handler may have deleted an original.
    names = [update.id.name for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    with references.between_steps():
        changed = False
        for name in names:
            # Each sync() can remove followers, which are listed, too.
            armature = bpy.data.objects.get(name)
            if armature is not None and ik_live.was_switched_on(armature):
                changed |= ik_live.sync(armature)
        changed |= _note_problems()
        if changed:
            _refresh_meshes()


@persistent
def on_frame_change(*_args: object) -> None:
    if ik_in_depsgraph.problems and _may_change():
        with references.between_steps():
            if _note_problems():
                _refresh_meshes()


def _note_problems() -> bool:
    """Returns whether constraints have changed."""
    changed = False
    while ik_in_depsgraph.problems:
        name, text = ik_in_depsgraph.problems.popitem()
        armature = bpy.data.objects.get(name)
        if armature is not None and ik_live.is_live(armature):
            changed |= ik_live.fail(armature, text)
    return changed


def _may_change() -> bool:
    """Not on other threads: the thread of a render in a window reads what the main one would change."""
    return is_main_thread() and not is_rendering_in_window() and not _State.is_saving


class _State:
    is_saving = False
    # Contexts of the running save, closed after it.
    out_of_the_file = ExitStack()


@persistent
def before_undo(*_args: object) -> None:
    ik_live.remove_unrecorded()


@persistent
def on_data_new(*_args: object) -> None:
    _State.is_saving = False
    ik_live.forget()
    sync_all()


@persistent
def on_undone(*_args: object) -> None:
    ik_live.remove_returned()
    on_data_new()


@persistent
def on_loaded(*_args: object) -> None:
    on_data_new()
    # Blender makes the file's first undo step after this.
    ik_live.note_step()


@persistent
def on_save(*_args: object) -> None:
    # Not under a render's thread: with Sinew, the saved file is complete, as an autosave is.
    if _may_change():
        _State.is_saving = True
        _State.out_of_the_file.enter_context(ik_live.out_of_the_file())


@persistent
def on_saved(*_args: object) -> None:
    _State.out_of_the_file.close()
    _State.is_saving = False
    sync_all()


_HANDLERS = {
    "depsgraph_update_post": on_depsgraph_update,
    "frame_change_post": on_frame_change,
    "undo_pre": before_undo,
    "redo_pre": before_undo,
    "undo_post": on_undone,
    "redo_post": on_undone,
    "load_post": on_loaded,
    "save_pre": on_save,
    "save_post": on_saved,
    "save_post_fail": on_saved,
}


def subscribe() -> None:
    events.subscribe_all(_HANDLERS)
    subscribers.safe_mode_changed.append(sync_all)


def unsubscribe() -> None:
    events.unsubscribe_all(_HANDLERS)
    subscribers.safe_mode_changed.remove(sync_all)


def adopt_open_file() -> None:
    if hasattr(bpy.data, "objects") and getattr(bpy.context, "view_layer", None) is not None:
        on_data_new()


def detach_all() -> None:
    """Detaches all live trees: Blender's constraints play, as in a saved file."""
    for armature in list(_armatures()):
        ik_live.detach(armature)
        ik_live.remove_followers(armature)
    ik_live.forget()
