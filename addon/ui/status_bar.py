# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's progress bar in the status bar, for operators that run in steps or in the background."""

from __future__ import annotations

import bpy

# In units of a button's width.
WIDTH = 24


def show(workspace: bpy.types.WorkSpace, text: str, share: float) -> None:
    """Shows a bar filled to `share`, 0 to 1, until clear(); `text` is translated already."""

    def draw(header: bpy.types.Header, _context: bpy.types.Context) -> None:
        row = header.layout.row()
        row.ui_units_x = WIDTH
        row.progress(factor=share, text=text, translate=False)

    workspace.status_text_set(draw)


def clear(workspace: bpy.types.WorkSpace) -> None:
    """Shows again what Blender shows by itself."""
    workspace.status_text_set(None)
