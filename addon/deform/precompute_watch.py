# SPDX-License-Identifier: GPL-3.0-or-later
"""A timer of the window that watches precomputations while one runs, and gives objects their results."""

import time

import bpy

from ..attach.subscribers import notify, subscribers
from ..attach.updates import phase
from ..skinning.precompute import precomputations
from . import precomputing, session
from .plan import State
from .session import current
from .skinned_object import SkinnedObject

SECONDS = 0.1
# A changed mesh's data is computed again after so many seconds without a change.
PAUSE = 0.4
_STROKES = ("PAINT_OT_", "SCULPT_OT_")


def begin() -> None:
    """Starts the timer, which runs as long as there is something to watch."""
    if not bpy.app.background and not bpy.app.timers.is_registered(check):
        bpy.app.timers.register(check, first_interval=SECONDS, persistent=True)


def check() -> float | None:
    """Returns the seconds to the next call; None where nothing is left to watch."""
    if phase.is_saving or phase.is_rendering:
        return SECONDS
    has_ended = is_outdated = False
    # Read first: a run that ends meanwhile gets another check.
    was_running = bool(precomputations.running)
    for obj, skinned in session.living_pairs():
        # A render may have computed it meanwhile.
        if precomputing.take_results(obj, skinned) or skinned.has_new_data:
            has_ended = skinned.needs_plan = True
        is_outdated |= _see_to_outdated(obj, skinned)
    if has_ended:
        session.refresh_between_steps(bpy.context)
    notify(subscribers.precomputation_shown)
    return SECONDS if was_running or is_outdated or precomputations.running else None


def _see_to_outdated(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    depsgraph = bpy.context.view_layer.depsgraph
    # While an object is off, nothing that its data could be computed from is read.
    if depsgraph is None or skinned.plan.state is State.OFF:
        return False
    before = 0.0 if _is_painting() else time.monotonic() - PAUSE
    return precomputing.request_outdated(obj, skinned, depsgraph, before)


def _is_painting() -> bool:
    """Whether a paint or sculpt stroke is in progress."""
    windows = bpy.context.window_manager.windows
    return any(
        operator.bl_idname.startswith(_STROKES) for window in windows for operator in window.modal_operators
    )


def stop() -> None:
    """Stops what runs, because the artist does not want it; resume() starts it again."""
    precomputations.stop()
    _refresh()


def resume() -> None:
    precomputations.stopped.clear()
    _refresh()


def finish(context: bpy.types.Context) -> None:
    """Returns when all objects have what their methods need; for operators that go through frames."""
    if not all(precomputing.has_all(obj, skinned) for obj, skinned in current.pairs):
        with precomputing.blocking():
            session.refresh(context)


def _refresh() -> None:
    for _obj, skinned in current.pairs:
        skinned.needs_plan = True
    session.refresh(bpy.context)
    begin()
