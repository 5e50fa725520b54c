# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C in a command. Blender drops a KeyboardInterrupt that is raised within its handlers and goes on: so
there it waits for the next check(), which comes with each frame and each step of a progress."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_asked = False


@contextmanager
def heard() -> Iterator[None]:
    """Inside, Ctrl-C raises KeyboardInterrupt, be it later; pressed again, at once."""
    global _asked
    if threading.current_thread() is not threading.main_thread():
        # Python tells the main thread alone.
        yield
        return
    before = signal.signal(signal.SIGINT, _on_interrupt)
    try:
        yield
    finally:
        _asked = False
        # None was Blender's own, which can not be put back.
        signal.signal(signal.SIGINT, before or signal.default_int_handler)


def check() -> None:
    """Raises KeyboardInterrupt where Ctrl-C was pressed."""
    if _asked:
        raise KeyboardInterrupt


def _on_interrupt(_signal: int, frame: FrameType | None) -> None:
    global _asked
    if _asked or not _is_in_blender(frame):
        raise KeyboardInterrupt
    _asked = True


def _is_in_blender(frame: FrameType | None) -> bool:
    """Whether code on bpy is at work, which Blender may have called."""
    while frame is not None:
        if "blender" in frame.f_globals.get("__name__", "").split("."):
            return True
        frame = frame.f_back
    return False
