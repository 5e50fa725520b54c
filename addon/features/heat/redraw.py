# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps numbers in the sidebar up to date where Blender would not redraw it, as in playback."""

from __future__ import annotations

import bpy

from ...attach.updates import is_rendering_in_window

# A panel with numbers was drawn since they last changed, so it is open.
wanted = False


def request() -> None:
    """Redraws the sidebar after the numbers have changed."""
    global wanted
    if not wanted or is_rendering_in_window():
        return
    wanted = False
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
