# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens to the open file as a whole: undo, redo, loading, saving, rendering, and the end of Sinew.
Each of Blender's events has one handler, which calls the subscribers in order."""

import contextlib
import functools
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import bpy
from bpy.app.handlers import persistent

from ..attach import note, overrides, point_store, properties, references, undeformed, upstream_proxy
from ..attach.feature import Feature
from ..attach.subscribers import notify, subscribers
from ..attach.updates import is_rendering_in_window, phase, updates_suspended
from ..io.actions import animated_paths
from ..skinning.precompute import precomputations
from . import apply_plan, events, handlers, precompute_watch, precomputing, session
from .changes import Changes

log = logging.getLogger("sinew")


def _handler(function: Callable[[bool], None]) -> Callable[..., None]:
    """Returns a handler that runs when no other thread reacts. It gets whether to react, and evaluates
    nothing."""

    @persistent
    @functools.wraps(function)
    def handle(*_args: object) -> None:
        with updates_suspended() as may_react:
            function(may_react)

    return handle


# --- Undo, redo, loading


@_handler
def before_step(_may_react: bool) -> None:
    phase.is_saving = False
    between = list(filter(properties.has_sinew, references.noted()))
    session.forget_for_step({obj.session_uid for obj in between})
    for obj in between:
        point_store.clear_references(obj)
    references.forget()


@_handler
def after_step(_may_react: bool) -> None:
    for obj in filter(properties.has_sinew, bpy.data.objects):
        point_store.clear_references_to_itself(obj)
    undeformed.find_leftovers()
    session.adopt_after_step()
    notify(subscribers.stepped)


@_handler
def before_loading(_may_react: bool) -> None:
    """Every reference becomes invalid."""
    precomputations.cancel_all()
    phase.is_saving = False
    session.forget()
    notify(subscribers.loading)


@persistent
def on_loaded(*_args: object) -> None:
    with updates_suspended():
        session.forget()
        references.forget()
        overrides.restore()
        note.remove()
        notify(subscribers.loaded)
        if not session.objects_with_sinew():
            return
    # This is the file's first evaluation. Like the one that Blender would make, it has to be one of time,
    # too, or poses that differ from their keys would stay.
    for obj in bpy.data.objects:
        if obj.animation_data is not None:
            obj.update_tag(refresh={"TIME"})
    session.refresh(bpy.context)
    # The file's first undo step comes after this.
    references.forget()


# --- Saving


@dataclass
class _Saving:
    """on_before   the session_uid of objects that Sinew deformed before the file was prepared
    references  what objects referred to by then, as from point_store.references_of(), by their session_uid;
                without those that had been given it since the last undo step
    failures    what failed for an object when the file was saved last, by its session_uid
    """

    on_before: set[int] = field(default_factory=set)
    references: dict[int, list[int]] = field(default_factory=dict)
    failures: dict[int, str] = field(default_factory=dict)


_saving = _Saving()


@persistent
def on_save(*_args: object) -> None:
    """From here to on_saved() Sinew changes nothing in the file, even if Blender evaluates it, as for its
    thumbnail."""
    with updates_suspended() as may_react:
        if not may_react or (session.current.is_idle and not undeformed.has_leftovers()):
            return
    if is_rendering_in_window():
        # A thread reads the file meanwhile. With Sinew, the saved file is complete, as an autosave is.
        log.warning("Saved during a render: save again after it, for Blenders without Sinew")
        return
    # So that the artist's last changes are seen separately from those made for saving.
    bpy.context.evaluated_depsgraph_get()
    noted = references.noted()
    _saving.references = {
        obj.session_uid: point_store.references_of(obj)
        for obj in session.objects_with_sinew()
        if obj not in noted
    }
    # First, so that whatever happens, on_saved() reverses it.
    phase.is_saving = True
    prepare_for_save()


@persistent
def on_saved(*_args: object) -> None:
    with updates_suspended() as may_react:
        if not (may_react and phase.is_saving):
            return
        phase.is_saving = False
    with references.between_steps():
        resume_after_save(bpy.context)
    # What they refer to as before is in the last step.
    for obj in filter(properties.has_sinew, references.noted()):
        if _saving.references.get(obj.session_uid) == point_store.references_of(obj):
            references.forget(obj)


def prepare_for_save() -> None:
    """Changes the file so that a Blender without Sinew plays it, with the nearest shape that Blender has.
    Raises nothing: what fails is reported, and the rest of the file is prepared."""
    undeformed.remove_leftovers()
    notify(subscribers.saving)
    objects = [obj for obj in bpy.data.objects if properties.has_sinew(obj) and obj.is_editable]
    # Known before anything can fail, so that resume_after_save() reverses all of it.
    _saving.on_before = {obj.session_uid for obj in objects if properties.of(obj).replaces_modifiers}
    _saving.failures.clear()
    with updates_suspended():
        for obj in objects:
            with _logging_failure("A Blender without Sinew will not show it posed", obj):
                apply_plan.apply_saved(obj, session.plan_of(obj))
                overrides.store(obj)
        with _logging_failure("What the methods need is not in the file, and is computed again"):
            precomputing.store_in_meshes([(obj, session.skinned_of(obj)) for obj in objects])
        with _logging_failure("The file does not say that it uses Sinew"):
            note.write([obj for obj in objects if properties.of(obj).before.has_nearest_volume])


@contextlib.contextmanager
def _logging_failure(consequence: str, obj: bpy.types.Object | None = None) -> Iterator[None]:
    """Logs an error instead of passing it on: what is next to be saved is in the same file. The panel shows
    that of an object."""
    try:
        yield
    except Exception as error:
        text = f"{consequence}: {type(error).__name__}: {error}"
        if obj is not None:
            _saving.failures[obj.session_uid] = text
            text = f"{obj.name}: {text}"
        log.error("%s", text, exc_info=error)


def resume_after_save(context: bpy.types.Context) -> None:
    """Reverses prepare_for_save(). Raises nothing of its own."""
    with _logging_failure("The file still says that Sinew is missing"):
        note.remove()
    with updates_suspended():
        for obj in filter(properties.has_sinew, bpy.data.objects):
            session.expect_mesh_update(obj)
            if not obj.is_editable:
                continue
            with _logging_failure("Not as before it was saved; press Rebind", obj):
                apply_plan.apply_resumed(obj, obj.session_uid in _saving.on_before)
    session.refresh(context)


def failure_of_saving(obj: bpy.types.Object) -> str:
    """Returns what failed for it when the file was saved last, as a sentence; empty for nothing."""
    return _saving.failures.get(obj.session_uid, "")


@contextlib.contextmanager
def changing_for_file(context: bpy.types.Context) -> Iterator[None]:
    """Like changing(), for a file that was opened to be saved with the new settings: at its end the file is
    also prepared for saving. To work on with the file, call resume_after_save().

    Blender has the poses from opening the file, so only objects that had Sinew before or have upstream
    modifiers have to be evaluated.
    """
    with updates_suspended():
        yield
        session.current.objects = None
        depsgraph, changes = context.view_layer.depsgraph, Changes()
        had_sinew = depsgraph is not None and any(
            properties.has_sinew(obj.evaluated_get(depsgraph)) for obj in session.objects_with_sinew()
        )
        if depsgraph is None or had_sinew:
            depsgraph = context.evaluated_depsgraph_get()
        session.update_all(depsgraph, changes)
        if session.without_upstream():
            session.update_all(context.evaluated_depsgraph_get(), changes)
        upstream_proxy.compared.clear()
        prepare_for_save()


# --- Rendering


@persistent
def on_render_start(*_args: object) -> None:
    phase.is_rendering = True
    precomputations.blocks = True


@_handler
def on_render_end(_may_react: bool) -> None:
    """Runs in the render's thread, if it has one: what waited for its end is left to the main thread."""
    phase.is_rendering = False
    precomputations.blocks = bpy.app.background
    if not bpy.app.background and not bpy.app.timers.is_registered(_after_render):
        bpy.app.timers.register(_after_render, first_interval=0.05)


def _after_render() -> float | None:
    if is_rendering_in_window():
        return 0.05
    must_refresh = phase.must_refresh or any(skinned.needs_plan for _obj, skinned in session.current.pairs)
    phase.must_refresh = False
    if must_refresh:
        session.refresh_between_steps(bpy.context)
    return None


# --- Beginning and end

_HANDLERS = {
    "undo_pre": before_step,
    "undo_post": after_step,
    "redo_pre": before_step,
    "redo_post": after_step,
    "load_pre": before_loading,
    "load_post": on_loaded,
    "save_pre": on_save,
    "save_post": on_saved,
    "save_post_fail": on_saved,
    "render_init": on_render_start,
    "render_complete": on_render_end,
    "render_cancel": on_render_end,
}


def _begin() -> None:
    precomputing.begin()
    handlers.register()
    events.subscribe_all(_HANDLERS)


def _end() -> None:
    # Nobody will want what runs.
    precomputations.cancel_all()
    if bpy.app.timers.is_registered(precompute_watch.check):
        bpy.app.timers.unregister(precompute_watch.check)
    events.unsubscribe_all(_HANDLERS)
    handlers.unregister()


FEATURE = Feature(
    subscriptions=(
        (subscribers.precomputation_requested, precompute_watch.begin),
        (subscribers.before_removal, session.forget_object),
    ),
    begin=_begin,
    end=_end,
)


def adopt_open_file() -> None:
    """Takes over the objects of a file that was open before Sinew was registered."""
    # While Blender starts, its data is not accessible, and loading the first file does this.
    if hasattr(bpy.data, "objects") and getattr(bpy.context, "view_layer", None) is not None:
        note.remove()
        for obj in filter(properties.has_sinew, bpy.data.objects):
            # Without Sinew, Blender did not evaluate the keys of its settings.
            if any(path.startswith("sinew.") for path in animated_paths(obj)):
                obj.update_tag(refresh={"TIME"})
        session.refresh(bpy.context)


def leave_open_file() -> None:
    """Leaves the file as a saved one is: the Armature modifiers deform."""
    prepare_for_save()
    note.remove()
