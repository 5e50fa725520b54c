# SPDX-License-Identifier: GPL-3.0-or-later
"""Prepares a plain Python with bpy for the commands, and ends its process."""

import os
import shutil
from typing import NoReturn

from .base import interrupt
from .base.errors import SinewError


def prepare_blender() -> None:
    """Registers Sinew in Blender. Raises SinewError where this Python has no Blender."""
    try:
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
    interrupt.check()


def leave_blender(status: int) -> NoReturn:
    """Ends the process without Blender's cleanup as a module: after a glTF export, 4.2 crashes in it, and 4.5
    can hang."""
    import bpy

    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(status)
