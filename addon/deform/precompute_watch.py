# SPDX-License-Identifier: GPL-3.0-or-later
"""A timer of the window's that sees to precomputations as long as one runs, and gives objects what comes of
it."""

from __future__ import annotations

import time

import bpy

from ..attach.subscribers import notify, subscribers
from ..core.precompute import precomputations
from . import precomputing, session
from .plan import State
from .session import current
from .skinned_object import SkinnedObject

SECONDS = 0.1
# As long nothing may have changed before data is made anew of a mesh that changed.
PAUSE = 0.4
_STROKES = ("PAINT_OT_", "SCULPT_OT_")


def begin() -> None:
    """As long as there is something to see to."""
    if not bpy.app.background and not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=SECONDS, persistent=True)


def look() -> float | None:
    """Seconds to the next time; None where nothing is to be seen to any more."""
    if current.is_saving or current.is_rendering:
        return SECONDS
    has_ended = is_outdated = False
    for obj, skinned in list(current.pairs):
        try:
            # A render may have made it meanwhile.
            if precomputing.take_results(obj, skinned) or skinned.has_new_data:
                has_ended = skinned.needs_apply = True
            is_outdated |= _see_to_outdated(obj, skinned)
        except ReferenceError:
            # Deleted since the objects were listed.
            continue
    if has_ended:
        session.refresh_between_steps(bpy.context)
    notify(subscribers.precomputation_shown)
    return SECONDS if is_outdated or precomputations.running else None


def _see_to_outdated(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    depsgraph = bpy.context.view_layer.depsgraph
    # While an object is off, nothing of it is read that its data could be made from.
    if depsgraph is None or skinned.plan.state is State.OFF:
        return False
    before = 0.0 if _is_painting() else time.monotonic() - PAUSE
    return precomputing.request_outdated(obj, skinned, depsgraph, before)


def _is_painting() -> bool:
    """Whether a stroke goes on."""
    windows = bpy.context.window_manager.windows
    return any(
        operator.bl_idname.startswith(_STROKES) for window in windows for operator in window.modal_operators
    )


def stop() -> None:
    """What runs, the artist does not want; it starts again by go_on()."""
    precomputations.stop()
    _refresh()


def go_on() -> None:
    precomputing.forget_stopped()
    _refresh()


def finish(context: bpy.types.Context) -> None:
    """Returns when all objects have what their methods need: for operators that go through frames."""
    if not all(precomputing.has_all(obj, skinned) for obj, skinned in current.pairs):
        with precomputing.waiting():
            session.refresh(context)


def _refresh() -> None:
    for _obj, skinned in current.pairs:
        skinned.needs_apply = True
    session.refresh(bpy.context)
    begin()
