# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew's part in Blender's own evaluation: the driver of pose_driver asks for a mesh's points, after the
poses and before the modifiers, and they are written into the evaluated mesh.

Blender evaluates on many threads, and for a render beside the window. So only evaluated data is read here:
an original may go at any moment. What is out of the ordinary, such as changed weights, is left to the
handlers, which come afterwards and may change the file.
"""

from __future__ import annotations

import threading

import bpy
import sinew

from . import skinned_object
from .skinned_object import SkinnedObject


class _Thread(threading.local):
    """What is kept for each of Blender's threads: the object that was named last.

    Blender's threads are none of Python's: each call from one makes a state of Python's for it and takes it
    away again, 50 to 100 us on two cores. Here it stays until the thread ends.
    """

    def __init__(self) -> None:
        self.requesting: bpy.types.Object | None = None
        sinew.keep_thread_state()


class DepsgraphRequests:
    """Answers the driver: first it names the object, then, on the same thread, the mesh."""

    def __init__(self) -> None:
        self._thread = _Thread()
        # By the object's name, which its evaluated copies have too. Replaced, never changed: other threads
        # may be reading it.
        self._states: dict[str, SkinnedObject] = {}

    def set_objects(self, states: dict[str, SkinnedObject]) -> None:
        self._states = states

    def object_requested(self, evaluated: bpy.types.Object) -> None:
        self._thread.requesting = evaluated

    def mesh_requested(self, evaluated_mesh: bpy.types.Mesh) -> None:
        evaluated, self._thread.requesting = self._thread.requesting, None
        if evaluated is None or not (evaluated.is_evaluated and evaluated_mesh.is_evaluated):
            # Somebody else reads the property.
            return
        state = self._states.get(evaluated.name)
        if state is None:
            return
        try:
            skinned_object.deform_evaluated(evaluated, evaluated_mesh, state)
        except Exception as error:
            # The handlers see to it, and the panel tells.
            state.fail(error)
