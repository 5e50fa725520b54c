# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds out whether Blender can draw on this machine."""

import subprocess
import sys

_PROBE = (
    "import bpy; s = bpy.context.scene; s.render.engine = 'BLENDER_WORKBENCH'; "
    "s.render.resolution_x = s.render.resolution_y = 8; bpy.ops.render.render()"
)


def default_engine(blender: str = "") -> str:
    """The default engine for pictures: "workbench", or "cycles" where Workbench cannot render."""
    return "workbench" if has_opengl(blender) else "cycles"


def has_opengl(blender: str = "") -> bool:
    """Whether Workbench can render here. Tried in a new Blender process, which takes as long as starting
    Blender, because Blender aborts without OpenGL.

    blender  the program's path; "" where it is a module of this Python
    """
    if blender:
        command = [blender, "--background", "--factory-startup", "--python-expr", _PROBE]
    else:
        command = [sys.executable, "-c", _PROBE]
    try:
        probe = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return probe.returncode == 0
