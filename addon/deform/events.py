# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's functions in the lists of those that Blender calls at events, bpy.app.handlers."""

from collections.abc import Callable, Mapping

import bpy

_OURS = __package__.rpartition(".")[0]

# At these events others can change meshes while Sinew works.
_CHANGING_EVENTS = (
    "depsgraph_update_pre",
    "depsgraph_update_post",
    "frame_change_pre",
    "frame_change_post",
    "save_pre",
    "save_post",
)


def others_are_subscribed() -> bool:
    """Whether Blender calls functions of others while Sinew changes settings or the file is saved."""
    return any(
        not _is_ours(function) for event in _CHANGING_EVENTS for function in getattr(bpy.app.handlers, event)
    )


def others_follow(event: str, function: Callable) -> bool:
    """Whether Blender calls functions of others after this one of Sinew's."""
    functions = getattr(bpy.app.handlers, event)
    if function not in functions:
        return False
    return any(not _is_ours(each) for each in functions[functions.index(function) + 1 :])


def others_precede(event: str, function: Callable) -> bool:
    """Whether Blender calls functions of others before this one of Sinew's."""
    for each in getattr(bpy.app.handlers, event):
        if each is function:
            return False
        if not _is_ours(each):
            return True
    return False


def _is_ours(function: Callable) -> bool:
    return f"{getattr(function, '__module__', None)}.".startswith(f"{_OURS}.")


def subscribe(event: str, function: Callable) -> None:
    """Has Blender call the function. Subscribing it again changes nothing."""
    functions = getattr(bpy.app.handlers, event)
    if function not in functions:
        functions.append(function)


def is_last(event: str, function: Callable) -> bool:
    functions = getattr(bpy.app.handlers, event)
    return bool(functions) and functions[-1] is function


def unsubscribe(event: str, function: Callable) -> None:
    """Must not be called while Blender iterates over the event's functions: Blender would skip one."""
    functions = getattr(bpy.app.handlers, event)
    if function in functions:
        functions.remove(function)


def subscribe_all(handlers: Mapping[str, Callable]) -> None:
    for event, function in handlers.items():
        subscribe(event, function)


def unsubscribe_all(handlers: Mapping[str, Callable]) -> None:
    for event, function in handlers.items():
        unsubscribe(event, function)
