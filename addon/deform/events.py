# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender calls at its events: the lists of bpy.app.handlers."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import bpy

# Blender 4.2 has no event for objects that come from another file: there each frame has to be checked.
IMPORTS_ARE_ANNOUNCED = hasattr(bpy.app.handlers, "blend_import_post")


# What Sinew does at a change of frame, by event (handlers.py): only where there is something to do.
FRAME_HANDLERS: dict[str, Callable] = {}
# What suspends modifiers after all other functions and restores them before any, where there are some.
GATE_HANDLERS: dict[str, Callable] = {}

_OURS = __package__.rpartition(".")[0]

# At these others can change meshes while Sinew works.
_CHANGING_EVENTS = (
    "depsgraph_update_pre",
    "depsgraph_update_post",
    "frame_change_pre",
    "frame_change_post",
    "save_pre",
    "save_post",
)


def others_are_subscribed() -> bool:
    """Whether Blender calls others than Sinew while Sinew changes settings or the file is saved."""
    return any(
        not _is_ours(function) for event in _CHANGING_EVENTS for function in getattr(bpy.app.handlers, event)
    )


def others_follow(event: str, function: Callable) -> bool:
    """Whether Blender calls others than Sinew after one of its functions."""
    functions = getattr(bpy.app.handlers, event)
    if function not in functions:
        return False
    return any(not _is_ours(each) for each in functions[functions.index(function) + 1 :])


def others_precede(event: str, function: Callable) -> bool:
    """Whether Blender calls others than Sinew before one of its functions."""
    for each in getattr(bpy.app.handlers, event):
        if each is function:
            return False
        if not _is_ours(each):
            return True
    return False


def _is_ours(function: Callable) -> bool:
    return (getattr(function, "__module__", None) or "").startswith(_OURS)


def subscribe(event: str, function: Callable) -> None:
    """Has Blender call the function; once, however often this is."""
    functions = getattr(bpy.app.handlers, event)
    if function not in functions:
        functions.append(function)


def call_first(event: str, function: Callable) -> None:
    """Has Blender call it before all others. Not to be called while Blender goes through the functions."""
    functions = getattr(bpy.app.handlers, event)
    if not functions or functions[0] is not function:
        unsubscribe(event, function)
        functions.insert(0, function)


def call_last(event: str, function: Callable) -> None:
    """Has Blender call it after all others. Called from one of them, it holds at once."""
    if not is_last(event, function):
        unsubscribe(event, function)
        subscribe(event, function)


def is_last(event: str, function: Callable) -> bool:
    functions = getattr(bpy.app.handlers, event)
    return bool(functions) and functions[-1] is function


def unsubscribe(event: str, function: Callable) -> None:
    """Not to be called while Blender goes through the event's functions: it would leave one out."""
    functions = getattr(bpy.app.handlers, event)
    if function in functions:
        functions.remove(function)


def subscribe_all(handlers: Mapping[str, Callable]) -> None:
    for event, function in handlers.items():
        subscribe(event, function)


def unsubscribe_all(handlers: Mapping[str, Callable]) -> None:
    for event, function in handlers.items():
        unsubscribe(event, function)
