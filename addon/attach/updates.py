# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes handlers of Blender's events run on one thread at a time, and ignore events that Sinew itself causes.
A window that renders calls handlers from the render's thread, too."""

from dataclasses import dataclass

import bpy
import sinew

_lock = sinew.Lock()
# Blender registers extensions on its main thread.
_main_thread = sinew.thread_id()
# How many updates_suspended() blocks the thread that has the lock is in.
_depth = 0


class _Suspension:
    """A class, as a generator's context takes longer than the work of most frames."""

    def __enter__(self) -> bool:
        global _depth
        _lock.__enter__()
        _depth += 1
        return _depth == 1

    def __exit__(self, *error: object) -> None:
        global _depth
        _depth -= 1
        _lock.__exit__(*error)


_SUSPENSION = _Suspension()


def updates_suspended() -> _Suspension:
    """Context for all that Sinew changes, and for its reactions to events. Events inside, on this thread, are
    only noted for the refresh() that has to follow; those of other threads wait until the end. Its value is
    False inside of another one: whoever is there may only note an event."""
    return _SUSPENSION


@dataclass
class Phase:
    """What Blender does with the file as a whole (deform/lifecycle.py).

    is_saving     it is written
    is_rendering  between the events of a render's start and end
    must_refresh  something waits for the end of a render
    """

    is_saving: bool = False
    is_rendering: bool = False
    must_refresh: bool = False


phase = Phase()


def is_rendering_in_window() -> bool:
    """Whether a separate thread renders."""
    return not bpy.app.background and bpy.app.is_job_running("RENDER")


def may_change_file() -> bool:
    """Whether modifiers, drivers and objects may be changed: not while they are written, nor while the thread
    of a render reads them. Also, only the main thread may notify the window of a change."""
    return not (phase.is_saving or is_rendering_in_window())


def is_main_thread() -> bool:
    return sinew.thread_id() == _main_thread
