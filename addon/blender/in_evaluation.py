# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's part in Blender's own evaluation: the driver of pose_driver asks for a mesh's points, after the
poses and before the modifiers, and they are written into the evaluated mesh.

Blender evaluates on many threads, and for a render beside the window. What is out of the ordinary, such as
changed weights, is left to the handlers, which come afterwards and may change the file.
"""

from __future__ import annotations

import ctypes
import logging
import threading
from collections.abc import Callable

import bpy

from . import driven
from .driven import Driven

log = logging.getLogger("sinew")


class _Thread(threading.local):
    """What is kept for each of Blender's threads: the object that was named last.

    Blender's threads are none of Python's: each call from one makes a state of Python's for it and takes it
    away again, 50 to 100 us on two cores. Here the first call leaves it in place for those that follow.
    """

    def __init__(self) -> None:
        self.asking: bpy.types.Object | None = None
        # Counts callers of the thread's state. Never released, this one keeps it as long as the thread lives.
        ctypes.pythonapi.PyGILState_Ensure()


class Answers:
    """Answers the driver: first it names the object, then, on the same thread, the mesh.

    state_of  gives what is known of a driven object
    """

    def __init__(self, state_of: Callable[[bpy.types.Object], Driven | None]) -> None:
        self._state_of = state_of
        self._thread = _Thread()

    def object_asked(self, evaluated: bpy.types.Object) -> None:
        self._thread.asking = evaluated

    def mesh_asked(self, evaluated_mesh: bpy.types.Mesh) -> None:
        evaluated, self._thread.asking = self._thread.asking, None
        if evaluated is None or not evaluated_mesh.is_evaluated:
            # Somebody else reads the property.
            return
        state = self._state_of(evaluated.original)
        if state is None:
            return
        try:
            driven.deform_evaluated(evaluated, evaluated_mesh, state)
        except Exception as error:
            # Bones or mesh differ from what is bound. The handlers see to that, and report what stays wrong.
            log.debug("%s: %s", evaluated.name, error)
