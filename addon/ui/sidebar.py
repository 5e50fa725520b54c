# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab, and what is in it where the native library does not load."""

from __future__ import annotations

import textwrap

import bpy

from .. import native

# Characters of the interface font that fit a pixel of sidebar at scale 1; a label is not wrapped by Blender.
CHARACTERS_PER_PIXEL = 0.14


class Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Sinew"


class SINEW_PT_unavailable(Sidebar, bpy.types.Panel):
    bl_label = "Sinew"

    def draw(self, context: bpy.types.Context) -> None:
        draw_text(self.layout, context, native.load_error() or "Restart Blender to use Sinew", icon="ERROR")


def draw_text(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    text: str,
    icon: str = "NONE",
    alert: bool = False,
) -> None:
    """Text broken into as many labels as the sidebar's width needs."""
    scale = context.preferences.system.ui_scale
    width = max(20, int(context.region.width / scale * CHARACTERS_PER_PIXEL) - (4 if icon != "NONE" else 0))
    column = layout.column(align=True)
    column.alert = alert
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, width)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE")
