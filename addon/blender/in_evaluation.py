# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's part in Blender's own evaluation: the driver of pose_driver asks for a mesh's points, after the
poses and before the modifiers, and they are written into the evaluated mesh.

Blender evaluates on many threads, and for a render beside the window. What is out of the ordinary, such as
changed weights, is left to the handlers, which come afterwards and may change the file.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

import bpy

from . import driven
from .driven import Driven

log = logging.getLogger("sinew")


class Answers:
    """Answers the driver: first it names the object, then, on the same thread, the mesh.

    state_of  gives what is known of a driven object
    """

    def __init__(self, state_of: Callable[[bpy.types.Object], Driven | None]) -> None:
        self._state_of = state_of
        # By thread. Python's own thread-local data is gone between two calls from a thread of Blender's.
        self._asking: dict[int, bpy.types.Object] = {}

    def object_asked(self, evaluated: bpy.types.Object) -> None:
        self._asking[threading.get_ident()] = evaluated

    def mesh_asked(self, evaluated_mesh: bpy.types.Mesh) -> None:
        evaluated = self._asking.pop(threading.get_ident(), None)
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
