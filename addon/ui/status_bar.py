# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's progress bar in the status bar, for what runs in steps or beside the artist's work."""

from __future__ import annotations

import bpy

# In widths of a button.
WIDTH = 24


def show(workspace: bpy.types.WorkSpace, text: str, share: float) -> None:
    """Until clear(): a bar that is full to `share`, with a text in the user's language."""

    def draw(header: bpy.types.Header, _context: bpy.types.Context) -> None:
        row = header.layout.row()
        row.ui_units_x = WIDTH
        row.progress(factor=share, text=text, translate=False)

    workspace.status_text_set(draw)


def clear(workspace: bpy.types.WorkSpace) -> None:
    """What Blender shows by itself."""
    workspace.status_text_set(None)
