# SPDX-License-Identifier: GPL-3.0-or-later
"""Prepares a plain Python with bpy for the commands, and ends its process."""

import os
import shutil
import signal
import sys
import threading
from contextlib import nullcontext
from typing import NoReturn

from .core.errors import SinewError


def prepare_blender() -> None:
    """Registers Sinew in Blender. Raises SinewError where this Python has no Blender."""
    try:
        # Only the main thread can handle signals.
        is_main = threading.current_thread() is threading.main_thread()
        with _Interrupts() if is_main and "bpy" not in sys.modules else nullcontext():
            import bpy
    except ImportError as error:
        raise SinewError(f"this Python has no Blender: {error}; install bpy") from None
    from . import native, registration
    from .attach import normals
    from .deform import small_meshes

    reason = native.load_error()
    if reason is not None:
        raise SinewError(reason)
    # Commands compare, save and bake Sinew's own deformation, also of small meshes.
    small_meshes.is_used = False
    # Most of what commands do reads points only.
    normals.are_used = False
    if not hasattr(bpy.types.Object, "sinew"):
        registration.register()


class _Interrupts:
    """Notes Ctrl-C while Blender is imported. Blender puts a handler of its own in place of Python's, and its
    scripts hide what is raised in them; each module that they import has Python's handler set again."""

    def __init__(self) -> None:
        self.was_one = False

    def __enter__(self) -> None:
        self.find_spec()
        sys.meta_path.insert(0, self)

    def __exit__(self, *_error: object) -> None:
        sys.meta_path.remove(self)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if self.was_one:
            raise KeyboardInterrupt

    def find_spec(self, *_module: object) -> None:
        signal.signal(signal.SIGINT, self._note)

    def _note(self, *_signal: object) -> None:
        self.was_one = True


def leave_blender(status: int) -> NoReturn:
    """Ends the process without Blender's cleanup as a module: after a glTF export, 4.2 crashes in it, and 4.5
    can hang."""
    import bpy

    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(status)
