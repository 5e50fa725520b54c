# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's events: on each frame and each change, look up the driven objects, deform, write."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import bpy
from bpy.app.handlers import persistent

from ..core.errors import SinewError
from . import drive, driven, events, overrides, points, properties, redraw
from .changes import Changes
from .driven import Driven
from .gate import Gate, is_allowed
from .heat import heat_map, heat_view, measures
from .in_evaluation import Answers

log = logging.getLogger("sinew")


@dataclass
class Session:
    """The driven objects of the open file. Objects are kept by reference between events only; undo and
    loading make all references void, so both forget everything."""

    objects: list[bpy.types.Object] | None = None
    object_count: int = 0
    driven: dict[int, Driven] = field(default_factory=dict)
    depsgraph: int = 0  # the address of the one last seen
    waiting: set[int] = field(default_factory=set)  # as _waiting()
    gate: Gate = field(default_factory=Gate)
    updating: bool = False
    settling: bool = False  # what Sinew itself changed is evaluated, and nothing else
    all_left: bool = False  # to Blender, and nothing but what they are told of can change that

    @property
    def idle(self) -> bool:
        """Nothing is driven, and nothing has come since that was seen."""
        return self.objects == [] and self.object_count == len(bpy.data.objects)

    def forget(self) -> None:
        self.objects = None
        hear_frames()
        self.depsgraph = 0
        self.waiting = set()
        self.driven.clear()


session = Session()


def state_of(obj: bpy.types.Object) -> Driven | None:
    """What the panel shows of a driven object; None before its first frame."""
    return session.driven.get(obj.session_uid)


answers = Answers(state_of)


def states_of(
    objects: Iterable[bpy.types.Object] | None, depsgraph: bpy.types.Depsgraph | None
) -> list[tuple[bpy.types.Object, Driven]]:
    """Those of driven objects that Sinew deforms now, or would were they not left to Blender, with what is
    known of them from this evaluation; none without one."""
    if depsgraph is None:
        return []
    known = []
    for obj in objects or ():
        state = state_of(obj) if properties.of(obj).enabled else None
        if state is None:
            continue
        with contextlib.suppress(SinewError):
            current = driven.bring_up_to_date(obj, state, depsgraph)
            session.driven[obj.session_uid] = current
            known.append((obj, current))
    return [(obj, state) for obj, state in known if state.frames is not None]


def refresh(context: bpy.types.Context) -> None:
    """Deforms all driven objects at the current frame, as after a change of settings."""
    if session.updating:
        # Held, or a handler turned an object off: another evaluation now could be from a render's thread.
        return
    session.objects = None
    depsgraph = context.evaluated_depsgraph_get()
    _update(depsgraph, Changes())
    _ignore_frames()
    # In a window the tagged meshes are evaluated before the next redraw; a script may read them at once.
    if bpy.app.background:
        # Where all is known, only what was just written is new: weights need not be read again for that.
        with contextlib.nullcontext() if _waiting() else held():
            context.view_layer.update()


@contextlib.contextmanager
def held() -> Iterator[None]:
    """Changes and events inside are not looked at before the refresh() that has to follow."""
    before, session.updating = session.updating, True
    try:
        yield
    finally:
        session.updating = before


@contextlib.contextmanager
def changing(context: bpy.types.Context) -> Iterator[None]:
    """Settings are changed inside, and all is deformed by them at the end."""
    # What others changed before is seen apart from it.
    context.evaluated_depsgraph_get()
    with held():
        yield
    session.settling = True
    try:
        refresh(context)
    finally:
        session.settling = False


@contextlib.contextmanager
def changing_for_file(context: bpy.types.Context) -> Iterator[None]:
    """The same for a file that was opened to be saved so: at the end Sinew is laid down, too. To go on with
    it, take_up() and refresh().

    Blender has the poses from opening the file, and has to evaluate only what was driven before or has
    something in front.
    """
    with held():
        yield
        session.objects = None
        depsgraph, changes = context.view_layer.depsgraph, Changes()
        driven_before = depsgraph is not None and any(
            properties.is_driven(obj.evaluated_get(depsgraph)) for obj in _driven_objects(changes)
        )
        if depsgraph is None or driven_before:
            depsgraph = context.evaluated_depsgraph_get()
        _update(depsgraph, changes)
        if _waiting():
            _update(context.evaluated_depsgraph_get(), changes)
        lay_down()


def _waiting() -> set[int]:
    """The session_uid of each driven object that waits for what Blender makes of the modifiers in front."""
    driven_now = [(obj, properties.of(obj)) for obj in _driven_objects(Changes()) if state_of(obj) is None]
    return {obj.session_uid for obj, settings in driven_now if settings.enabled and settings.standing_in}


def lay_down() -> None:
    """A saved file has the Armature modifiers' pointers: without Sinew they need only switching on."""
    for obj in bpy.data.objects:
        if properties.is_driven(obj):
            keep_shown(obj)
            drive.give_back(obj)
            overrides.keep(obj)


def keep_shown(obj: bpy.types.Object) -> None:
    """What was given to the evaluated mesh alone becomes part of the file."""
    state, depsgraph = state_of(obj), bpy.context.view_layer.depsgraph
    if state is not None and not state.is_kept and depsgraph is not None:
        points.keep_shown(obj, depsgraph)
        state.is_kept = True


def take_up() -> None:
    """The way back from lay_down()."""
    for obj in bpy.data.objects:
        if properties.is_driven(obj) and properties.of(obj).standing_in:
            drive.clear_pointers(obj)
            state = state_of(obj)
            if state is not None:
                driven.hold_pose(obj, state)


def _method_changed(_obj: bpy.types.Object, context: bpy.types.Context) -> None:
    refresh(context)


def _enabled_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    settings = properties.of(obj)
    drive.switch(obj, settings.enabled)
    if not settings.enabled:
        points.put_away(obj)
    settings.error = ""
    state = state_of(obj)
    if settings.enabled and state is not None and settings.armature is not None:
        driven.hold_pose(obj, state)
    refresh(context)


def _heat_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    if not properties.is_driven(obj):
        return
    if not properties.of(obj).heat:
        heat_view.take_off(obj)
    points.arrange(obj)
    refresh(context)
    heat_view.tidy()


def rebind(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    """Reads everything of the object anew: mesh, weights, bones. Switches it on again after an error."""
    session.driven.pop(obj.session_uid, None)
    settings = properties.of(obj)
    settings.error = ""
    if not settings.enabled:
        settings.enabled = True  # refreshes
    else:
        refresh(context)


def _update(depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    with held():
        for obj in _driven_objects(changes):
            _update_or_turn_off(obj, depsgraph, changes)
        session.all_left = _are_all_left()
        _hear_needed_frames()
        heated = [obj for obj in session.objects or () if properties.of(obj).heat]
        heat_map.update(states_of(heated, depsgraph), depsgraph)
        redraw.tell()


def _update_or_turn_off(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    try:
        if properties.of(obj).enabled:
            state = driven.update(obj, state_of(obj), depsgraph, changes)
            if state is None:
                session.driven.pop(obj.session_uid, None)
            else:
                session.driven[obj.session_uid] = state
    except ReferenceError:
        # Deleted since the objects were listed.
        session.objects = None
    except Exception as error:
        _turn_off(obj, properties.of(obj), error)


def _driven_objects(changes: Changes) -> list[bpy.types.Object]:
    if session.objects is None or changes.structure or len(bpy.data.objects) != session.object_count:
        session.objects = [obj for obj in bpy.data.objects if properties.is_driven(obj)]
        session.object_count = len(bpy.data.objects)
        heat_view.sync(session.objects)
        points.separate(session.objects)
        known = {obj.session_uid for obj in session.objects}
        session.driven = {uid: state for uid, state in session.driven.items() if uid in known}
    return session.objects


def _turn_off(obj: bpy.types.Object, settings: properties.SinewSettings, error: Exception) -> None:
    """Hands a failing object back to its Armature modifier, and says why once."""
    session.driven.pop(obj.session_uid, None)
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


def _are_all_left() -> bool:
    """Whether frames have nothing for Sinew, as long as nothing but poses changes."""
    try:
        at_work = [obj for obj in session.objects or () if properties.of(obj).enabled]
        return all(
            (state := state_of(obj)) is not None and state.is_left and obj.animation_data is None
            for obj in at_work
        )
    except ReferenceError:
        return False


def _are_all_answered(depsgraph: bpy.types.Depsgraph) -> bool:
    """Whether the evaluation gave all driven objects their points, and there is nothing else to look at."""
    objects, known = session.objects, session.driven
    if (
        objects is None
        or session.depsgraph != depsgraph.as_pointer()
        or not Changes.are_of_meshes_only(depsgraph)
    ):
        return False
    # What is left does not ask which they are, and they take long to list.
    meshes = set() if session.all_left else Changes.meshes_in(depsgraph)
    try:
        for obj in objects:
            state = known.get(obj.session_uid)
            if state is None:
                if properties.of(obj).enabled:
                    return False
            elif not (state.is_answered(obj, depsgraph) and state.is_untouched_by_frame(obj, meshes)):
                return False
    except ReferenceError:
        # Deleted since the objects were listed.
        return False
    redraw.tell()
    return True


def hear_frames() -> None:
    """Blender calls at each change of frame, until it is known that there is nothing to do."""
    session.all_left = False
    events.hear_all(_FRAME_HANDLERS)


def _hear_needed_frames() -> None:
    if session.objects:
        events.hear("frame_change_post", on_frame_change)
    if not session.all_left:
        events.hear("frame_change_pre", before_frame_change)


def _ignore_frames() -> None:
    """Leaves out what is not needed: a function of Python's takes 3 to 10 us of a frame in any case."""
    if session.idle and events.IMPORTS_ARE_TOLD:
        events.ignore_all(_FRAME_HANDLERS)
    elif session.all_left:
        events.ignore("frame_change_pre", before_frame_change)


@persistent
def before_update(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
    for state in session.driven.values():
        state.answered = 0


@persistent
def before_frame_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    before_update(scene, depsgraph)
    if not any(state.dirtied_by_frames for state in session.driven.values()) or not is_allowed():
        return
    for obj in session.objects or ():
        state = state_of(obj)
        if state is not None and state.dirtied_by_frames:
            session.gate.close(obj)


@persistent
def on_frame_change(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if session.all_left and Changes.are_motion_only(depsgraph):
        redraw.tell()
        return
    gated = session.gate.open()
    if session.idle or _are_all_answered(depsgraph):
        return
    changes = _read_changes(depsgraph, frame=True)
    changes.gated = gated
    _follow(depsgraph, changes)


def _follow(depsgraph: bpy.types.Depsgraph, changes: Changes) -> None:
    _update(depsgraph, changes)
    known, session.waiting = session.waiting, _waiting()
    # What handlers change Blender evaluates without telling of it. Once for each: what is in another scene
    # goes on waiting.
    if session.waiting - known and depsgraph == bpy.context.view_layer.depsgraph:
        refresh(bpy.context)


@persistent
def on_depsgraph_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if session.updating:
        return
    if session.idle:
        _ignore_frames()
        return
    changes = _read_changes(depsgraph, frame=False)
    if session.settling:
        # Settings touch the meshes. Nobody changed weights, and they take long to read.
        changes.meshes.clear()
    _follow(depsgraph, changes)
    _ignore_frames()


@persistent
def on_data_replaced(*_args: object) -> None:
    """Undo, redo and loading: every reference is void and the attributes hold other points."""
    session.forget()


@persistent
def on_loaded(*_args: object) -> None:
    session.forget()
    overrides.take_back()
    refresh(bpy.context)


@persistent
def on_imported(*_args: object) -> None:
    """Scripts can go to another frame without any other event."""
    hear_frames()


@persistent
def on_save(*_args: object) -> None:
    if session.updating or session.idle:
        return
    # What the artist changed last is looked at now, for what saving changes will not be.
    bpy.context.evaluated_depsgraph_get()
    lay_down()


@persistent
def on_saved(*_args: object) -> None:
    if session.updating or session.idle:
        return
    take_up()
    with held():
        bpy.context.view_layer.update()


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
}
if events.IMPORTS_ARE_TOLD:
    _HANDLERS["blend_import_post"] = on_imported


def register() -> None:
    session.forget()
    properties.listeners.method_changed = _method_changed
    properties.listeners.enabled_changed = _enabled_changed
    properties.listeners.object_asked = answers.object_asked
    properties.listeners.mesh_asked = answers.mesh_asked
    properties.listeners.heat_changed = _heat_changed
    measures.Listener.changed = refresh
    events.hear_all(_HANDLERS)


def adopt_open_file() -> None:
    """Takes over the driven objects of a file that was open before Sinew was registered."""
    # While Blender starts, its data is out of reach, and loading the first file takes care of it.
    if hasattr(bpy.data, "objects") and getattr(bpy.context, "view_layer", None) is not None:
        refresh(bpy.context)


def unregister() -> None:
    session.forget()
    events.ignore_all({**_HANDLERS, **_FRAME_HANDLERS})
