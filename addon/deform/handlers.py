# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's handlers of evaluations and changes of frame."""

import contextlib
from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent

from ..attach import layout, pose_driver, properties, references, stack, undeformed, upstream_proxy
from ..attach.subscribers import notify, subscribers
from ..attach.updates import (
    is_main_thread,
    is_rendering_in_window,
    may_change_file,
    phase,
    updates_suspended,
)
from . import events, rigid_bodies, session
from .changes import Changes, Find, finder, names_of_changed_meshes
from .session import current

# --- Evaluations and changes of frame


@persistent
def before_update(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
    _subscribe_behind_others("depsgraph_update_post", on_depsgraph_update)
    _begin_evaluation()
    _take_off_drivers_without_modifier()


def _take_off_drivers_without_modifier() -> None:
    """Removes drivers where Sinew's modifier was applied or deleted: Blender would print a warning for a
    driver on a missing modifier. The next evaluation is the first without the modifier."""
    with updates_suspended() as may_react:
        if not (may_react and may_change_file()):
            return
        for obj, skinned in session.living_pairs():
            is_missing = skinned.plan.is_in_depsgraph and skinned.noted.layout.sinew not in obj.modifiers
            # The modifier may have been renamed.
            if is_missing and obj.is_editable and stack.sinew_modifier(obj) is None:
                pose_driver.remove(obj)


@persistent
def on_depsgraph_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    is_posed, unshown = False, None
    with updates_suspended() as may_react:
        if not current.is_idle:
            original = finder("depsgraph_update_post", on_depsgraph_update)
            is_posed = may_react and may_change_file() and session.were_only_posed(depsgraph, original)
            if not is_posed:
                unshown = _react(depsgraph, _read_changes(depsgraph, original, frame=False), may_react)
    _end_event("depsgraph_update_post", depsgraph, unshown)
    if not is_posed:
        notify(subscribers.evaluated, depsgraph)


@persistent
def before_frame_change(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
    if may_change_file():
        undeformed.remove_leftovers()
    if current.all_use_builtin:
        return
    _subscribe_behind_others("frame_change_post", on_frame_change)
    _begin_evaluation()


@persistent
def on_frame_change(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if current.all_use_builtin and Changes.are_motion_only(depsgraph):
        notify(subscribers.frame_shown)
        return
    unshown = None
    with updates_suspended() as may_react:
        if not current.is_idle:
            original = finder("frame_change_post", on_frame_change)
            if not session.were_all_deformed(depsgraph, original):
                unshown = _react(depsgraph, _read_changes(depsgraph, original, frame=True), may_react)
        if depsgraph.scene.rigidbody_world is not None and may_react and may_change_file():
            rigid_bodies.make_again(depsgraph.scene, (obj for obj, _state in current.pairs))
    _end_event("frame_change_post", depsgraph, unshown)


def _begin_evaluation() -> None:
    is_renamed = False
    for obj, skinned in current.pairs:
        evaluation = skinned.evaluation
        evaluation.given = set()
        try:
            evaluation.is_only_user = skinned.noted.own.mesh_users == obj.data.users
            is_renamed |= skinned.noted.name != obj.name
        except ReferenceError:
            # The object was deleted since the list was made.
            evaluation.is_only_user = False
    if is_renamed:
        session.name_requests()


def _end_event(event: str, depsgraph: bpy.types.Depsgraph, unshown: Changes | None) -> None:
    """Called at the end of each reaction.

    event    after whose reaction functions behind Sinew's may be called; empty at their own
    unshown  as from _react()
    """
    if unshown is not None:
        _keep_evaluated_shapes(unshown)
        # No window need show it.
        with bpy.context.temp_override(scene=depsgraph.scene, view_layer=depsgraph.view_layer):
            session.refresh_between_steps(bpy.context)
    upstream_proxy.compared.clear()
    session.note_shown(depsgraph)
    is_followed = bool(event) and events.is_last(event, _LAST[-1])
    current.seen = names_of_changed_meshes(depsgraph) if is_followed else None


def _read_changes(depsgraph: bpy.types.Depsgraph, original: Find, frame: bool) -> Changes:
    """An evaluation's list of updates is complete only where the one before was seen, too: a render has a
    depsgraph of its own."""
    same = current.depsgraph == depsgraph.as_pointer()
    current.depsgraph = depsgraph.as_pointer()
    return Changes.read(depsgraph, frame, same, original, current.is_after_step)


def _react(depsgraph: bpy.types.Depsgraph, changes: Changes, may_react: bool) -> Changes | None:
    """Reacts to an evaluation. It is only noted where Sinew itself caused it, where Blender evaluates while
    saving (others' changes may be in the same list), and for the window during a render: points written after
    the update would then belong to the render's frame.

    Returns the changes where an object gets its shape only with another evaluation."""
    waits_for_render = is_rendering_in_window() and is_main_thread()
    phase.must_refresh |= waits_for_render
    if not may_react or phase.is_saving or waits_for_render:
        if current.missed is None:
            current.missed = changes
        else:
            current.missed.add(changes)
        return None
    with references.between_steps():
        session.update_all(depsgraph, changes)
    before, current.without_upstream = current.without_upstream, session.without_upstream()
    # What handlers change, Blender evaluates without an event. Once for each upstream proxy: one in another
    # scene goes on waiting.
    is_new = bool(current.without_upstream - before)
    return changes if is_new and depsgraph == depsgraph.view_layer.depsgraph else None


def _keep_evaluated_shapes(changes: Changes) -> None:
    """Keeps shapes before another evaluation within the handlers of one. Where that copies an object again
    whose shape is from this one, Blender would show the mesh without modifiers and shape keys (seen on 4.2 to
    5.2)."""
    for obj in bpy.data.objects:
        if obj.session_uid in changes.objects:
            obj.update_tag(refresh={"DATA"})


# --- Functions of other add-ons that Blender calls behind Sinew's


def _subscribe_behind_others(event: str, function: Callable) -> None:
    """Before an event: has Blender call `_LAST` after all other functions, if there are others behind
    `function`. `_LAST` has two functions, as Blender skips the one behind a function that removes itself."""
    if current.seen is not None or events.is_last(event, function):
        return
    are_there = events.is_last(event, _LAST[-1])
    # After an undo step, the objects have to be found again.
    are_needed = current.objects != [] and events.others_follow(event, function)
    if are_there == are_needed:
        return
    for each in _LAST:
        events.unsubscribe(event, each)
        if are_needed:
            events.subscribe(event, each)


@persistent
def after_others(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Reacts to what handlers behind Sinew's change: Blender evaluates it without an event, but lists it
    among the updates at once. A mesh that was listed before these were called may have changed again.

    Where Sinew deforms after the update, what they pose or move is handled at the next event: evaluating
    within a handler can crash Blender (4.2).
    """
    seen, current.seen = current.seen, None
    if seen is None:
        return
    names, new, unshown = names_of_changed_meshes(depsgraph), Changes(complete=True), None
    with updates_suspended() as may_react:
        unread = []
        for obj, skinned in session.living_pairs():
            if not skinned.is_as_noted(obj, layout.read(obj)):
                # For example its modifiers, which decide who computes its normals.
                new.objects.add(obj.session_uid)
            if obj.data.name_full not in names:
                continue
            if obj.data.name_full in seen or properties.of(obj).storage.upstream_proxy is not None:
                unread.append(obj)
                if not upstream_proxy.is_current(obj):
                    upstream_proxy.follow_points(obj)
            else:
                new.meshes.add(obj.data.session_uid)
        if new.meshes or new.objects:
            new.touched |= new.meshes | new.objects
            # Sinew's own changes came before these handlers.
            current.expected -= new.meshes
            unshown = _react(depsgraph, new, may_react)
        for obj in unread:
            with contextlib.suppress(ReferenceError):
                skinned = session.skinned_of(obj)
                if skinned is not None:
                    skinned.needs_recheck = True
                    # The upstream proxy is evaluated again only now.
                    skinned.evaluation.changed_unannounced |= obj.data.name_full not in seen
    _end_event("", depsgraph, unshown)


@persistent
def after_others_again(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    after_others(scene, depsgraph)


def check_unannounced() -> float:
    """Timer of a window for what Blender evaluates without an event: what another add-on's handler changed
    behind Sinew's, and a view layer that is shown for the first time."""
    if any(skinned.evaluation.changed_unannounced for _obj, skinned in current.pairs):
        session.refresh_between_steps(bpy.context)
    if session.needs_first_evaluations():
        for window in bpy.context.window_manager.windows:
            if session.identity_of_layer(window.scene, window.view_layer) not in current.view_layers:
                with bpy.context.temp_override(window=window):
                    session.refresh_between_steps(bpy.context)
    return 0.25


# --- Registration

_LAST = (after_others, after_others_again)
_HANDLERS = {
    "depsgraph_update_pre": before_update,
    "depsgraph_update_post": on_depsgraph_update,
    "frame_change_pre": before_frame_change,
    "frame_change_post": on_frame_change,
}


def register() -> None:
    session.forget()
    properties.listeners.method_changed = session.setting_changed
    properties.listeners.twist_changed = session.refresh
    properties.listeners.error_requested = session.error_of
    properties.listeners.object_requested = session.requests.object_requested
    properties.listeners.mesh_requested = session.requests.mesh_requested
    events.subscribe_all(_HANDLERS)
    if not bpy.app.background:
        bpy.app.timers.register(check_unannounced, first_interval=1.0, persistent=True)


def unregister() -> None:
    session.forget()
    if bpy.app.timers.is_registered(check_unannounced):
        bpy.app.timers.unregister(check_unannounced)
    events.unsubscribe_all(_HANDLERS)
    for event in ("frame_change_post", "depsgraph_update_post"):
        for function in _LAST:
            events.unsubscribe(event, function)
