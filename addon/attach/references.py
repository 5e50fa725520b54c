# SPDX-License-Identifier: GPL-3.0-or-later
"""Records which objects were given new references by Sinew between two of Blender's undo steps.

Where an object is the same in two steps, undo keeps it as it is in memory. What Sinew made for it since the
last step (a helper, a node group) is in neither step and gone afterwards: Blender would read freed memory
(seen on 4.2 to 5.2). So point_store.clear_references() clears these references before undo.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

# The session_uid of each.
_noted: set[int] = set()
_is_between_steps = False


@contextmanager
def between_steps() -> Iterator[None]:
    """Context for what handlers and timers do. For operators and the panel, Blender makes an undo step."""
    global _is_between_steps
    before, _is_between_steps = _is_between_steps, True
    try:
        yield
    finally:
        _is_between_steps = before


def note(obj: bpy.types.Object) -> None:
    """Records an object that is about to get another reference."""
    if _is_between_steps:
        _noted.add(obj.session_uid)


def noted() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if obj.session_uid in _noted] if _noted else []


def forget(obj: bpy.types.Object | None = None) -> None:
    """Called where an undo step has, or will have, what was recorded.

    obj  None for all
    """
    if obj is None:
        _noted.clear()
    else:
        _noted.discard(obj.session_uid)
