# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's part in Blender's own evaluation: the driver of pose_driver asks for a mesh's points, after the
poses and before the modifiers, and they are written into the evaluated mesh.

Blender evaluates on many threads, and for a render beside the window. What is out of the ordinary, such as
changed weights, is left to the handlers, which come afterwards and may change the file.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import bpy

from . import driven
from .driven import Driven


class Answers:
    """Answers the driver: first it names the object, then, on the same thread, the mesh.

    state_of  gives what is known of a driven object
    """

    def __init__(self, state_of: Callable[[bpy.types.Object], Driven | None]) -> None:
        self._state_of = state_of
        self._thread = threading.local()
        self._errors: dict[int, Exception] = {}

    def object_asked(self, evaluated: bpy.types.Object) -> None:
        self._thread.object = evaluated if evaluated.is_evaluated else None

    def mesh_asked(self, evaluated_mesh: bpy.types.Mesh) -> None:
        evaluated = getattr(self._thread, "object", None)
        self._thread.object = None
        if evaluated is None or not evaluated_mesh.is_evaluated:
            # Somebody else reads the property.
            return
        state = self._state_of(evaluated)
        if state is None or evaluated.session_uid in self._errors:
            return
        try:
            driven.deform_evaluated(evaluated, evaluated_mesh, state)
        except Exception as error:
            self._errors[evaluated.session_uid] = error

    def raise_error(self, obj: bpy.types.Object) -> None:
        """Raises what went wrong with an object's points since this was asked last."""
        error = self._errors.pop(obj.session_uid, None) if self._errors else None
        if error is not None:
            raise error
