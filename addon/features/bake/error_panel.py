# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's panel of what a bake to bones left: numbers, and buttons of the heat map."""

from __future__ import annotations

import bpy

from ...io import units
from ...ui import operators
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import tr
from . import error_map


def _baked(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in operators.targets(context) if error_map.is_baked(obj)]


class SINEW_OT_bake_error(bpy.types.Operator):
    bl_idname = "sinew.bake_error"
    bl_label = "Show Bake Error"
    bl_description = (
        "Colour the meshes that were baked to bones by their distance from Sinew's shape, in 3D views in "
        "Solid shading. Switch it off before an export, which would write the colours"
    )
    bl_options = {"REGISTER", "UNDO"}

    errors: bpy.props.EnumProperty(
        name="Errors",
        description="Which errors to show",
        items=[
            (error_map.AFTER, "After", "Of the helper bones, over the frames of the bake"),
            (error_map.BEFORE, "Before", "Of linear blending with the weights before the bake"),
            (error_map.OFF, "Off", "No colours; views are as they were"),
        ],
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode.startswith("EDIT"):
            cls.poll_message_set(tr("Leave edit mode first"))
            return False
        if _baked(context):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Select a mesh that was baked to bones"))
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        error_map.show(_baked(context), self.errors)
        return {"FINISHED"}


class SINEW_PT_bake_error(Sidebar, bpy.types.Panel):
    bl_label = "Bake Error"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        # In edit mode attributes can not be read.
        return not context.mode.startswith("EDIT") and bool(_baked(context))

    def draw(self, context: bpy.types.Context) -> None:
        layout, scene, meshes = self.layout, context.scene, _baked(context)
        is_shown, row = error_map.shown(meshes), layout.row(align=True)
        labels = {error_map.BEFORE: "Before", error_map.AFTER: "After", error_map.OFF: "Off"}
        for choice, label in labels.items():
            row.operator("sinew.bake_error", text=label, depress=choice == is_shown).errors = choice
        before, after = (
            units.text(scene, "length", error_map.rms(meshes, choice)) for choice in error_map.OF_CHOICE
        )
        draw_text(layout, context, tr("RMS {before} before, {after} after", before=before, after=after))
        if is_shown != error_map.OFF:
            end = units.text(scene, "length", error_map.end_of_scale(meshes))
            text = tr("Dark violet is 0, yellow {end}: each vertex's RMS over the frames", end=end)
            draw_text(layout, context, text, icon="INFO")


CLASSES = (SINEW_OT_bake_error, SINEW_PT_bake_error)
