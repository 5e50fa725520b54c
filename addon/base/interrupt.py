# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C in a command. Blender ignores a KeyboardInterrupt raised within its handlers or while it starts, and
can crash then. So while code that uses bpy runs, Ctrl-C is only recorded, and the next check() raises it.
Commands call check() for each frame and step of progress."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_requested = False

# The folders and modules whose code Blender may have called.
_PACKAGE = __package__.rpartition(".")[0]
_ROOMS = ("io", "attach", "deform", "ui", "features", "jobs.tasks", "prepare", "native")
_ON_BPY = tuple(f"{_PACKAGE}.{room}." for room in _ROOMS)


@contextmanager
def deferred() -> Iterator[None]:
    """A context in which Ctrl-C raises KeyboardInterrupt at the next check(); pressed again, at once."""
    global _requested
    try:
        before = signal.signal(signal.SIGINT, _on_interrupt)
    except ValueError:
        # Only the main thread can handle signals.
        yield
        return
    try:
        yield
    finally:
        _requested = False
        # None stands for a handler of Blender's own, which cannot be restored.
        signal.signal(signal.SIGINT, before or signal.default_int_handler)


def is_requested() -> bool:
    """Whether Ctrl-C was pressed, and the next check() raises KeyboardInterrupt."""
    return _requested


def check() -> None:
    if _requested:
        raise KeyboardInterrupt


def _on_interrupt(_signal: int, frame: FrameType | None) -> None:
    global _requested
    if _requested or not _is_in_blender(frame):
        raise KeyboardInterrupt
    _requested = True


def _is_in_blender(frame: FrameType | None) -> bool:
    """Whether code that Blender may have called is running."""
    while frame is not None:
        if f"{frame.f_globals.get('__name__')}.".startswith(_ON_BPY):
            return True
        frame = frame.f_back
    return False
