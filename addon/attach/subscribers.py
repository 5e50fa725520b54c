# SPDX-License-Identifier: GPL-3.0-or-later
"""Features subscribe here to what Sinew does with its objects; nothing below the features imports them."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

import bpy


@dataclass
class Subscribers:
    """Each list is called in the order of subscription.

    evaluated                 Blender has evaluated a depsgraph where more changed than the frame or poses
    stepped                   an undo or redo step has ended
    loading                   another file is loaded
    loaded                    another file is there
    node_group                makes the node group of an object's modifier; None to use the standard one
    before_removal            Sinew is about to be taken off an object
    after_removal             Sinew was taken off an object
    objects_changed           these are the objects that have Sinew now
    deformed                  all objects have the shape of this evaluation, as far as handlers are concerned
    frame_shown               what the panel shows of a frame may differ
    saving                    the file is about to be saved
    safe_mode_changed         safe mode was switched on or off
    precomputation_requested  something is computed in the background, or will be
    precomputation_shown      the progress of that may differ
    """

    evaluated: list[Callable[[bpy.types.Depsgraph], None]] = field(default_factory=list)
    stepped: list[Callable[[], None]] = field(default_factory=list)
    loading: list[Callable[[], None]] = field(default_factory=list)
    loaded: list[Callable[[], None]] = field(default_factory=list)
    node_group: list[Callable[[bpy.types.Object], bpy.types.NodeTree | None]] = field(default_factory=list)
    before_removal: list[Callable[[bpy.types.Object], None]] = field(default_factory=list)
    after_removal: list[Callable[[], None]] = field(default_factory=list)
    objects_changed: list[Callable[[list[bpy.types.Object]], None]] = field(default_factory=list)
    deformed: list[Callable[[list[bpy.types.Object], bpy.types.Depsgraph], None]] = field(
        default_factory=list
    )
    frame_shown: list[Callable[[], None]] = field(default_factory=list)
    saving: list[Callable[[], None]] = field(default_factory=list)
    safe_mode_changed: list[Callable[[], None]] = field(default_factory=list)
    precomputation_requested: list[Callable[[], None]] = field(default_factory=list)
    precomputation_shown: list[Callable[[], None]] = field(default_factory=list)


log = logging.getLogger("sinew")
subscribers = Subscribers()
# The functions whose errors were reported.
_reported: set[Callable] = set()


def notify(functions: list[Callable], *arguments: object) -> list:
    """Calls each of the functions, and returns their results. One that raises costs itself alone; it is
    reported once."""
    results = []
    # A copy, as a function may remove itself.
    for function in list(functions):
        try:
            results.append(function(*arguments))
        except Exception as error:
            if function not in _reported:
                _reported.add(function)
                log.exception("%s failed: %s", function.__qualname__, error)
    return results
