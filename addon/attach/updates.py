# SPDX-License-Identifier: GPL-3.0-or-later
"""Who reacts to Blender's events: one thread at a time, and none to those that Sinew itself
causes. A window that renders calls handlers from the render's thread beside its own."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import bpy

_lock = threading.RLock()
# How many blocks of updates_suspended() the thread that holds the lock is in.
_depth = 0


@contextmanager
def updates_suspended() -> Iterator[None]:
    """Events inside, on this thread, are only noted for the refresh() that has to follow; those of other
    threads wait for the end."""
    global _depth
    with _lock:
        _depth += 1
        try:
            yield
        finally:
            _depth -= 1


def is_rendering_in_window() -> bool:
    """Whether a thread of its own renders. Modifiers, drivers and objects may not come or go then: the thread
    reads them, and telling the window of a change is for the main thread alone."""
    return not bpy.app.background and bpy.app.is_job_running("RENDER")


def is_playing_in_window() -> bool:
    """Whether a change of frame is that of a window that plays. Exporters that run beside it have a thread of
    their own."""
    if bpy.app.background or not is_main_thread():
        return False
    return any(window.screen.is_animation_playing for window in bpy.context.window_manager.windows)


def is_main_thread() -> bool:
    return threading.get_ident() == threading.main_thread().ident


class _Reaction:
    """A class, as a generator's context takes longer than what most frames ask of it."""

    def __enter__(self) -> bool:
        _lock.acquire()
        return _depth == 0

    def __exit__(self, *_error: object) -> None:
        _lock.release()


def reaction() -> _Reaction:
    """For what reacts to an event, once no other thread does: whether this one is to."""
    return _REACTION


_REACTION = _Reaction()
