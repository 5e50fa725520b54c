# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Blender from evaluating a mesh twice where a change of frame itself makes it dirty.

On a change of frame Blender evaluates, calls Sinew, and evaluates again what Sinew wrote. A mesh that moves,
or whose shape keys do, comes up in the first round too, with the points of the last frame: all for nothing,
and a simulation behind would run on the wrong shape. So its modifiers rest until the points are there.
"""

from __future__ import annotations

import bpy

from . import animation, node_group, stack


class Gate:
    """The modifiers that rest between Blender's two rounds."""

    def __init__(self) -> None:
        self._resting: list[tuple[bpy.types.Object, str, bool, bool]] = []

    def close(self, obj: bpy.types.Object) -> None:
        for modifier in obj.modifiers:
            if (
                stack.is_on(modifier)
                and not node_group.is_sinew(modifier)
                and not animation.is_visibility_animated(obj, modifier)
            ):
                self._resting.append((obj, modifier.name, modifier.show_viewport, modifier.show_render))
                modifier.show_viewport = modifier.show_render = False

    def open(self) -> set[int]:
        """The session_uid of each object whose modifiers rested."""
        gated = {obj.session_uid for obj, *_flags in self._resting}
        for obj, name, viewport, render in self._resting:
            modifier = obj.modifiers[name]
            modifier.show_viewport, modifier.show_render = viewport, render
        self._resting.clear()
        return gated


def is_allowed() -> bool:
    """Not while a window renders: its thread may read the flags, but telling the window of a change is for
    the main thread alone."""
    return bpy.app.background or not bpy.app.is_job_running("RENDER")
