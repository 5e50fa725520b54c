# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of a comparison in the sidebar."""

from __future__ import annotations

import bpy

from ...attach import properties
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import tr
from . import comparison, comparison_state


class SINEW_PT_comparison(Sidebar, bpy.types.Panel):
    bl_label = "Compare"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        state = comparison_state.of_scene(context.scene)
        if state is None:
            layout.operator("sinew.compare", text="Compare…", icon="MOD_ARRAY")
            if comparison.is_on():
                draw_text(layout, context, "Another scene shows a comparison", icon="INFO")
                layout.operator("sinew.end_comparison", icon="X")
            return
        _draw_arrangement(layout, context, state)
        if state.collection is not None:
            layout.prop(state.collection, "hide_render", text="Render the Copies", invert_checkbox=True)
        row = layout.row(align=True)
        row.operator("sinew.compare", text="Methods…")
        row.operator("sinew.end_comparison", icon="X")


def _draw_arrangement(
    layout: bpy.types.UILayout, context: bpy.types.Context, state: comparison_state.SinewComparison
) -> None:
    methods = comparison_state.methods_of(state)
    if not methods:
        draw_text(layout, context, "The copies were deleted", icon="INFO")
        return
    layout.row(align=True).prop(state, "arrangement", expand=True)
    layout.prop(state, "spacing")
    if state.arrangement == comparison_state.OVERLAID and context.space_data.shading.type == "SOLID":
        layout.prop_enum(context.space_data.shading, "color_type", "OBJECT", text="Colour by Method")
    if state.arrangement == comparison_state.ONE_OF_TWO:
        column = layout.column(align=True)
        column.prop(state, "first", text="")
        column.prop(state, "second", text="")
        (shown,) = comparison_state.shown_methods(state)
        layout.operator("sinew.flip_comparison", text="Flip", icon="UV_SYNC_SELECT")
        draw_text(layout, context, tr("Shown: {method}", method=tr(properties.method_label(shown))))


CLASSES = (SINEW_PT_comparison,)
