# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps numbers in the sidebar up to date where Blender would not redraw it, as in playback."""

from ...attach.updates import is_rendering_in_window
from ...ui import sidebar

# A panel with numbers was drawn since they last changed, so it is open.
wanted = False


def request() -> None:
    """Redraws the sidebar after the numbers have changed."""
    global wanted
    if not wanted or is_rendering_in_window():
        return
    wanted = False
    sidebar.redraw()
