# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a plain Python with bpy ready for the commands, and ends it."""

from __future__ import annotations

import os
import shutil
from typing import NoReturn

from .core.errors import SinewError


def prepare_blender() -> None:
    """Makes Sinew's own properties known to Blender. Raises SinewError where there is no Blender."""
    try:
        import bpy
    except ImportError as error:
        raise SinewError(f"this Python has no Blender: {error}; install bpy") from None
    from . import native, registration
    from .deform import small_meshes

    reason = native.load_error()
    if reason is not None:
        raise SinewError(reason)
    # What commands compare, save and bake is Sinew's own.
    small_meshes.is_used = False
    if not hasattr(bpy.types.Object, "sinew"):
        registration.register()


def leave_blender(status: int) -> NoReturn:
    """Ends the process at once, all work done, without the ending of Blender as a module: having exported
    glTF, 4.2 crashes there, and 4.5 can hang."""
    import bpy

    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(status)
