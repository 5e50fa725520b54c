# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's events: on each frame and each change, look up the driven objects, deform, write."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import bpy
from bpy.app.handlers import persistent

from ..attach import attach, note, overrides, point_store, properties, stack
from ..attach.subscribers import notify, subscribers
from ..attach.updates import is_main_thread, is_rendering_in_window, reaction, updates_suspended
from ..core.errors import SinewError
from ..io.animation_paths import animated_paths
from . import after_update, apply_plan, events
from .changes import Changes, names_of_changed_meshes
from .gate import Gate
from .in_depsgraph import DepsgraphRequests
from .plan import Plan, State
from .skinned_object import SkinnedObject
from .update import update

log = logging.getLogger("sinew")


@dataclass
class Session:
    """The driven objects of the open file. Objects are kept by reference between events only; undo and
    loading make all references void, so both forget everything."""

    objects: list[bpy.types.Object] | None = None
    object_count: int = 0
    skinned: dict[int, SkinnedObject] = field(default_factory=dict)
    pairs: list[tuple[bpy.types.Object, SkinnedObject]] = field(default_factory=list)  # of both
    depsgraph: int = 0  # the address of the one last seen
    waiting: set[int] = field(default_factory=set)  # as _waiting()
    gate: Gate = field(default_factory=Gate)
    missed_changes: Changes | None = None  # of the evaluations that were not reacted to
    expected_meshes: set[int] = field(
        default_factory=set
    )  # meshes that Blender touches for a setting of Sinew's
    on_before_save: set[int] = field(
        default_factory=set
    )  # the objects that Sinew deformed before the file is saved
    is_saving: bool = False  # Blender writes the file: nothing may change
    must_refresh: bool = False  # something waits for the end of a render
    is_rendering: bool = False
    seen_meshes: set[str] | None = None  # meshes touched before others were called after Sinew
    all_use_builtin: bool = False  # to Blender, and nothing but what they are told of can change that

    @property
    def idle(self) -> bool:
        """Nothing is driven, and nothing has come since that was seen."""
        return self.objects == [] and self.object_count == len(bpy.data.objects)

    def forget(self) -> None:
        self.gate.restore()
        self.objects = None
        subscribe_to_frames()
        self.depsgraph = 0
        self.waiting = set()
        self.missed_changes = None
        self.seen_meshes = None
        self.expected_meshes = set()
        self.skinned.clear()
        self.pairs = []
        requests.set_objects({})


session = Session()
requests = DepsgraphRequests()


def state_of(obj: bpy.types.Object) -> SkinnedObject | None:
    """What the panel shows of a driven object; None before its first frame."""
    return session.skinned.get(obj.session_uid)


def states_of(
    objects: Iterable[bpy.types.Object] | None, depsgraph: bpy.types.Depsgraph | None
) -> list[tuple[bpy.types.Object, SkinnedObject]]:
    """Those of driven objects that Sinew deforms now, or would were they not left to Blender, with what is
    known of them from this evaluation; none without one."""
    if depsgraph is None:
        return []
    pairs = []
    for obj in objects or ():
        state = state_of(obj) if properties.of(obj).enabled else None
        if state is None:
            continue
        with contextlib.suppress(SinewError):
            after_update.bring_up_to_date(obj, state, depsgraph)
            pairs.append((obj, state))
    return [(obj, state) for obj, state in pairs if state.shown.frames is not None]


def refresh(context: bpy.types.Context) -> None:
    """Deforms all driven objects at the current frame, as after a change of settings."""
    if is_rendering_in_window():
        # Without waiting for the render's thread, which would make its next frame beside what follows.
        session.must_refresh = True
        return
    with reaction() as may_react:
        if not may_react or session.is_saving:
            # Suspended, or a handler turned an object off: who did that goes on.
            return
        session.objects = None
        for state in session.skinned.values():
            state.needs_apply = True
        depsgraph = context.evaluated_depsgraph_get()
        _update(depsgraph, Changes())
        _unsubscribe_from_frames()
        # In a window the tagged meshes are evaluated before the next redraw; a script may read them at once.
        if bpy.app.background:
            # Where all is known, only what was just changed is new: that needs no other look now.
            with contextlib.nullcontext() if _waiting() else updates_suspended():
                context.view_layer.update()


@contextlib.contextmanager
def changing(context: bpy.types.Context) -> Iterator[None]:
    """Settings are changed inside, and nothing else; all is deformed by them at the end."""
    # What others changed before is seen apart from it.
    context.evaluated_depsgraph_get()
    with updates_suspended():
        yield
    for obj in filter(properties.has_sinew, bpy.data.objects):
        _expect_mesh_update(obj)
    refresh(context)


@contextlib.contextmanager
def changing_for_file(context: bpy.types.Context) -> Iterator[None]:
    """The same for a file that was opened to be saved so: at the end it is prepared for that, too. To go on
    with it, resume_after_save().

    Blender has the poses from opening the file, and has to evaluate only what was driven before or has
    something in front.
    """
    with updates_suspended():
        yield
        session.objects = None
        depsgraph, changes = context.view_layer.depsgraph, Changes()
        had_sinew = depsgraph is not None and any(
            properties.has_sinew(obj.evaluated_get(depsgraph)) for obj in _skinned_objects(changes)
        )
        if depsgraph is None or had_sinew:
            depsgraph = context.evaluated_depsgraph_get()
        _update(depsgraph, changes)
        if _waiting():
            _update(context.evaluated_depsgraph_get(), changes)
        prepare_for_save()


def _waiting() -> set[int]:
    """The session_uid of each driven object that waits for what Blender makes of the modifiers in front."""
    on_now = [(obj, properties.of(obj)) for obj in _skinned_objects(Changes()) if state_of(obj) is None]
    return {obj.session_uid for obj, settings in on_now if settings.enabled and settings.replaces_modifiers}


def prepare_for_save() -> None:
    """The file is made one that a Blender without Sinew plays, by the nearest shape that it has."""
    session.gate.restore()
    objects = [obj for obj in bpy.data.objects if properties.has_sinew(obj) and obj.is_editable]
    session.on_before_save = set()
    with updates_suspended():
        for obj in objects:
            try:
                if attach.prepare_for_save(obj):
                    session.on_before_save.add(obj.session_uid)
                overrides.keep(obj)
            except Exception as error:
                # The others are in the same file.
                log.error("%s: not as a Blender without Sinew needs it", obj.name, exc_info=error)
        note.write([obj for obj in objects if properties.of(obj).is_saved])


def resume_after_save(context: bpy.types.Context) -> None:
    """The way back from prepare_for_save()."""
    note.remove()
    with updates_suspended():
        for obj in filter(properties.has_sinew, bpy.data.objects):
            _expect_mesh_update(obj)
            if obj.is_editable and stack.sinew_modifier(obj) is not None:
                attach.switch(obj, on=obj.session_uid in session.on_before_save)
    refresh(context)


def setting_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """One of Sinew's settings of an object was changed: its shape may differ."""
    refresh(context)
    # Blender touches the object's mesh next. In a window that is an evaluation of its own; a script may
    # change weights before.
    if not bpy.app.background:
        _expect_mesh_update(obj)


def _enabled_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    settings = properties.of(obj)
    if not settings.enabled and not is_rendering_in_window():
        apply_plan.apply(obj, apply_plan.plan_of(obj))
    settings.error = ""
    setting_changed(obj, context)


def rebind(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Reads everything of the object anew: mesh, weights, bones. Switches it on again after an error."""
    session.skinned.pop(obj.session_uid, None)
    settings = properties.of(obj)
    settings.error = ""
    if not settings.enabled:
        settings.enabled = True  # refreshes
    else:
        refresh(context)


def _update(depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    with updates_suspended():
        if session.missed_changes is not None:
            changes.add(session.missed_changes)
            session.missed_changes = None
        read_later = _drop_expected(changes)
        _adopt_copied_modifiers(changes)
        for obj in _skinned_objects(changes):
            _update_or_turn_off(obj, depsgraph, changes)
            state = state_of(obj)
            if state is not None and obj.data.session_uid in read_later:
                state.needs_recheck = True
        states = [(obj, state_of(obj)) for obj in _skinned_objects(Changes())]
        session.pairs = [(obj, state) for obj, state in states if state is not None]
        requests.set_objects({obj.name: state for obj, state in session.pairs})
        session.all_use_builtin = _do_all_use_builtin()
        _subscribe_to_needed_frames()
        notify(subscribers.deformed, session.objects or [], depsgraph)
        notify(subscribers.frame_shown)


def _adopt_copied_modifiers(changes: Changes) -> None:
    for obj in changes.edited if not is_rendering_in_window() else ():
        # It may have been deleted since.
        with contextlib.suppress(ReferenceError):
            is_plain = obj.type == "MESH" and obj.library is None and not properties.is_helper(obj)
            if is_plain and not properties.has_sinew(obj) and not properties.is_copy(obj):
                changes.structure |= apply_plan.adopt_copied_modifier(obj)


def _follow_removal(obj: bpy.types.Object, changes: Changes) -> bool:
    state = state_of(obj)
    is_named = changes.structure or obj.session_uid in changes.objects or not changes.complete
    if not is_named and (state is None or state.is_attached(obj)):
        return False
    if not obj.is_editable or is_rendering_in_window():
        return False
    if not apply_plan.has_lost_modifier(obj):
        return False
    # The last shape is worked out where it is asked for: not at each pose.
    known = (None, None) if state is None else (state.bound.source.points, state.points)
    apply_plan.follow_removal(obj, *known)
    session.skinned.pop(obj.session_uid, None)
    session.objects = None
    return True


def _update_or_turn_off(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    try:
        if _follow_removal(obj, changes):
            return
        if not properties.of(obj).enabled:
            state = state_of(obj)
            if state is not None:
                state.plan, state.needs_apply = Plan(State.OFF), True
            if properties.of(obj).replaces_modifiers and obj.is_editable and not is_rendering_in_window():
                # It was switched off while a window rendered.
                apply_plan.apply(obj, apply_plan.plan_of(obj))
        else:
            state = update(obj, state_of(obj), depsgraph, changes)
            if state is None:
                session.skinned.pop(obj.session_uid, None)
            else:
                session.skinned[obj.session_uid] = state
    except ReferenceError:
        # Deleted since the objects were listed.
        session.objects = None
    except Exception as error:
        _turn_off(obj, properties.of(obj), error)


def _skinned_objects(changes: Changes) -> list[bpy.types.Object]:
    if session.objects is None or changes.structure or len(bpy.data.objects) != session.object_count:
        session.objects = [obj for obj in bpy.data.objects if properties.has_sinew(obj)]
        session.object_count = len(bpy.data.objects)
        notify(subscribers.objects_changed, session.objects)
        point_store.unshare(session.objects)
        pairs = {obj.session_uid for obj in session.objects}
        session.skinned = {uid: state for uid, state in session.skinned.items() if uid in pairs}
    return session.objects


def _turn_off(obj: bpy.types.Object, settings: properties.SinewSettings, error: Exception) -> None:
    """Hands a failing object back to its Armature modifier, and says why once."""
    session.skinned.pop(obj.session_uid, None)
    if is_rendering_in_window():
        log.error("%s: %s; the last shape stays until the end of the render", obj.name, error)
        session.must_refresh = True
        return
    settings.enabled = False
    if isinstance(error, SinewError):
        settings.error = str(error)
        log.error("%s", error)
    else:
        settings.error = f"{obj.name}: {type(error).__name__}: {error}; press Rebind, or Remove"
        log.error("%s", settings.error, exc_info=error)


def _read_changes(depsgraph: bpy.types.Depsgraph, frame: bool) -> Changes:
    """What an evaluation lists is all only to who saw the one before: a render has a depsgraph of its own."""
    same = session.depsgraph == depsgraph.as_pointer()
    session.depsgraph = depsgraph.as_pointer()
    return Changes.read(depsgraph, frame, complete=same)


def _do_all_use_builtin() -> bool:
    """Whether frames have nothing for Sinew, as long as nothing but poses changes."""
    try:
        at_work = [obj for obj in session.objects or () if properties.of(obj).enabled]
        return all(
            (state := state_of(obj)) is not None and state.uses_builtin and obj.animation_data is None
            for obj in at_work
        )
    except ReferenceError:
        return False


def _were_all_deformed(depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether the evaluation gave all driven objects their points, and there is nothing else to look at."""
    objects, pairs = session.objects, session.skinned
    if (
        objects is None
        or session.depsgraph != depsgraph.as_pointer()
        or not Changes.are_of_meshes_only(depsgraph)
    ):
        return False
    # What is left does not ask which they are, and they take long to list.
    meshes = set() if session.all_use_builtin else Changes.meshes_in(depsgraph)
    try:
        for obj in objects:
            state = pairs.get(obj.session_uid)
            if state is None:
                if properties.of(obj).enabled:
                    return False
            elif state.plan.state is State.OFF:
                continue
            elif not (
                state.was_deformed(obj, depsgraph)
                and state.is_untouched_by_frame(obj, meshes)
                # Up to Blender 5.1 a modifier without its node group has Sinew asked all the same.
                and state.is_attached(obj)
            ):
                return False
    except ReferenceError:
        # Deleted since the objects were listed.
        return False
    notify(subscribers.frame_shown)
    return True


def subscribe_to_frames() -> None:
    """Blender calls at each change of frame, until it is known that there is nothing to do."""
    session.all_use_builtin = False
    events.subscribe_all(_FRAME_HANDLERS)


def _subscribe_to_needed_frames() -> None:
    if session.objects:
        events.subscribe("frame_change_post", on_frame_change)
    if not session.all_use_builtin:
        events.subscribe("frame_change_pre", before_frame_change)


def _unsubscribe_from_frames() -> None:
    """Leaves out what is not needed: a function of Python's takes 3 to 10 us of a frame in any case."""
    if session.idle and events.IMPORTS_ARE_ANNOUNCED:
        events.unsubscribe_all(_FRAME_HANDLERS)
    elif session.all_use_builtin:
        events.unsubscribe("frame_change_pre", before_frame_change)


def _subscribe_behind_others(event: str, function: Callable) -> None:
    """Before an event: has Blender call `_LAST` after all others where some come behind `function`. Two of
    them, as Blender leaves out the one behind a function that takes itself off."""
    if session.seen_meshes is not None or events.is_last(event, function):
        return
    are_there = events.is_last(event, _LAST[-1])
    are_needed = bool(session.objects) and events.others_follow(event, function)
    if are_there == are_needed:
        return
    for each in _LAST:
        events.unsubscribe(event, each)
        if are_needed:
            events.subscribe(event, each)


def _note_seen(event: str, depsgraph: bpy.types.Depsgraph) -> None:
    """At the end of Sinew's own reaction to an event."""
    are_called = events.is_last(event, _LAST[-1])
    session.seen_meshes = names_of_changed_meshes(depsgraph) if are_called else None


@persistent
def after_others(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """What handlers behind Sinew's change, Blender evaluates without telling anybody, but has it in its list
    of updates at once. A mesh that was there before they were called may have changed once more."""
    seen_meshes, session.seen_meshes = session.seen_meshes, None
    names = names_of_changed_meshes(depsgraph) if seen_meshes is not None else set()
    if not names:
        return
    new = Changes(complete=True)
    with reaction() as may_react:
        for obj, state in session.pairs:
            with contextlib.suppress(ReferenceError):
                if obj.data.name_full in names & seen_meshes:
                    state.needs_recheck = True
                elif obj.data.name_full in names:
                    new.meshes.add(obj.data.session_uid)
        if new.meshes:
            new.touched |= new.meshes
            # What Sinew does itself came before them.
            session.expected_meshes -= new.meshes
            _react(depsgraph, new, may_react)
    _end_of_announced()


@persistent
def after_others_again(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    after_others(scene, depsgraph)


@persistent
def before_update(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
    _subscribe_behind_others("depsgraph_update_post", on_depsgraph_update)
    _forget_deformed()


def _forget_deformed() -> None:
    for obj, state in session.pairs:
        evaluation = state.evaluation
        evaluation.mesh, evaluation.is_event_known, evaluation.was_tagged = 0, True, False
        try:
            state.is_only_user = state.mesh_users == obj.data.users
        except ReferenceError:
            # Deleted since the objects were listed.
            state.is_only_user = False


@persistent
def before_frame_change(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
    _subscribe_behind_others("frame_change_post", on_frame_change)
    _forget_deformed()
    if not any(state.dirtied_by_frames for state in session.skinned.values()) or is_rendering_in_window():
        return
    with reaction() as may_react, contextlib.suppress(ReferenceError):
        for obj in session.objects or () if may_react and not session.is_saving else ():
            state = state_of(obj)
            if state is not None and state.dirtied_by_frames:
                session.gate.suspend(obj, session.is_rendering)


@persistent
def on_frame_change(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if session.all_use_builtin and Changes.are_motion_only(depsgraph):
        notify(subscribers.frame_shown)
        return
    with reaction() as may_react:
        session.gate.restore()
        if not (session.idle or _were_all_deformed(depsgraph)):
            _react(depsgraph, _read_changes(depsgraph, frame=True), may_react)
    _end_of_announced()
    _note_seen("frame_change_post", depsgraph)


def _check_unannounced_changes() -> float:
    """What another add-on's handler changed behind Sinew's, Blender evaluates without telling anybody: in a
    window it is seen to a moment later."""
    if any(state.evaluation.changed_unannounced for _obj, state in session.pairs):
        refresh(bpy.context)
    return 0.25


def _end_of_announced() -> None:
    """What Blender evaluates from here to the next event is for a handler that changed something."""
    for _obj, state in session.pairs:
        state.evaluation.is_event_known = state.evaluation.was_tagged


@persistent
def on_depsgraph_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    with reaction() as may_react:
        if session.idle:
            if may_react:
                _unsubscribe_from_frames()
            return
        _react(depsgraph, _read_changes(depsgraph, frame=False), may_react)
        if may_react:
            _unsubscribe_from_frames()
    _end_of_announced()
    _note_seen("depsgraph_update_post", depsgraph)


def _react(depsgraph: bpy.types.Depsgraph, changes: Changes, may_react: bool) -> None:
    """To an evaluation. What Sinew itself causes, and what Blender evaluates while it saves, is only noted:
    it may have listed what others changed, too. So is what the window shows while it renders: points that are
    written after the update are those of the render's frame then."""
    waits_for_render = is_rendering_in_window() and is_main_thread()
    session.must_refresh |= waits_for_render
    if not may_react or session.is_saving or waits_for_render:
        if session.missed_changes is None:
            session.missed_changes = changes
        else:
            session.missed_changes.add(changes)
        return
    _update(depsgraph, changes)
    pairs, session.waiting = session.waiting, _waiting()
    # What handlers change Blender evaluates without telling of it. Once for each: what is in another scene
    # goes on waiting.
    if session.waiting - pairs and depsgraph == bpy.context.view_layer.depsgraph:
        refresh(bpy.context)


def _expect_mesh_update(obj: bpy.types.Object) -> None:
    """The next evaluation lists the object's mesh for what Sinew does itself."""
    session.expected_meshes.add(obj.data.session_uid)


def _drop_expected(changes: Changes) -> set[int]:
    """Takes the meshes out of the changes that are listed for what Sinew did. They are returned where
    somebody else may have changed them in the same moment: then they are read with the next event."""
    expected_meshes, session.expected_meshes = changes.meshes & session.expected_meshes, set()
    if changes.frame:
        return set()
    changes.meshes -= expected_meshes
    return expected_meshes if events.others_are_subscribed() or not bpy.app.background else set()


@persistent
def on_data_replaced(*_args: object) -> None:
    """Undo, redo and loading: every reference is void and what holds points has others."""
    with reaction():
        session.is_saving = False
        session.forget()


@persistent
def on_loaded(*_args: object) -> None:
    with reaction():
        session.forget()
        overrides.take_back()
        note.remove()
        if not _skinned_objects(Changes()):
            session.all_use_builtin = True
            _unsubscribe_from_frames()
            return
        # This evaluation is the file's first: as the one that Blender makes otherwise it is one of time, too,
        # or poses that differ from their keys would stay.
        for obj in bpy.data.objects:
            if obj.animation_data is not None:
                obj.update_tag(refresh={"TIME"})
        refresh(bpy.context)


@persistent
def on_imported(*_args: object) -> None:
    """Scripts can go to another frame without any other event."""
    subscribe_to_frames()


@persistent
def on_save(*_args: object) -> None:
    """From here to on_saved() nothing of Sinew's changes the file, whatever Blender evaluates for it, such as
    its thumbnail."""
    with reaction() as may_react:
        if may_react and not session.idle:
            # What the artist changed last is seen apart from what is changed for the file.
            bpy.context.evaluated_depsgraph_get()
            prepare_for_save()
            session.is_saving = True


@persistent
def on_saved(*_args: object) -> None:
    with reaction() as may_react:
        if may_react and session.is_saving:
            session.is_saving = False
            resume_after_save(bpy.context)


def begin_export() -> None:
    """From here to end_export() the file is as a saved one, and frames go on without Sinew."""
    with reaction() as may_react:
        if may_react and not (session.idle or session.is_saving):
            bpy.context.evaluated_depsgraph_get()
            prepare_for_save()
            note.remove()
            session.is_saving = True
            if not bpy.app.background:
                # An exporter that fails does not say that it has ended.
                bpy.app.timers.register(end_export, first_interval=0.0)


def end_export() -> None:
    on_saved()


@persistent
def on_render_start(*_args: object) -> None:
    session.is_rendering = True


@persistent
def on_render_end(*_args: object) -> None:
    """In the render's thread, where it has one: what waited for its end is for the main one."""
    with reaction():
        session.is_rendering = False
        session.gate.restore()
    if not bpy.app.background and not bpy.app.timers.is_registered(_after_render):
        bpy.app.timers.register(_after_render, first_interval=0.05)


def _after_render() -> float | None:
    if is_rendering_in_window():
        return 0.1
    late = session.must_refresh or any(state.needs_apply for state in session.skinned.values())
    session.must_refresh = False
    if late:
        refresh(bpy.context)
    return None


_LAST = (after_others, after_others_again)
_FRAME_HANDLERS = {"frame_change_pre": before_frame_change, "frame_change_post": on_frame_change}
_HANDLERS = {
    "depsgraph_update_pre": before_update,
    "depsgraph_update_post": on_depsgraph_update,
    "undo_pre": on_data_replaced,
    "undo_post": on_data_replaced,
    "redo_pre": on_data_replaced,
    "redo_post": on_data_replaced,
    "load_pre": on_data_replaced,
    "load_post": on_loaded,
    "save_pre": on_save,
    "save_post": on_saved,
    "save_post_fail": on_saved,
    "render_init": on_render_start,
    "render_complete": on_render_end,
    "render_cancel": on_render_end,
}
if events.IMPORTS_ARE_ANNOUNCED:
    _HANDLERS["blend_import_post"] = on_imported


def register() -> None:
    session.forget()
    properties.listeners.method_changed = setting_changed
    properties.listeners.enabled_changed = _enabled_changed
    properties.listeners.object_requested = requests.object_requested
    properties.listeners.mesh_requested = requests.mesh_requested
    events.subscribe_all(_HANDLERS)
    if not bpy.app.background:
        bpy.app.timers.register(_check_unannounced_changes, first_interval=1.0, persistent=True)


def adopt_open_file() -> None:
    """Takes over the driven objects of a file that was open before Sinew was registered."""
    # While Blender starts, its data is out of reach, and loading the first file takes care of it.
    if hasattr(bpy.data, "objects") and getattr(bpy.context, "view_layer", None) is not None:
        note.remove()
        for obj in filter(properties.has_sinew, bpy.data.objects):
            # Without Sinew, Blender went on without what keys set of its settings.
            if any(path.startswith("sinew.") for path in animated_paths(obj)):
                obj.update_tag(refresh={"TIME"})
        refresh(bpy.context)


def unregister() -> None:
    session.forget()
    if bpy.app.timers.is_registered(_check_unannounced_changes):
        bpy.app.timers.unregister(_check_unannounced_changes)
    events.unsubscribe_all({**_HANDLERS, **_FRAME_HANDLERS})
    for event in ("frame_change_post", "depsgraph_update_post"):
        for function in _LAST:
            events.unsubscribe(event, function)
