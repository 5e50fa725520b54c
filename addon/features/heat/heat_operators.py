# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons of the heat map and of worst frames."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...attach import properties
from ...deform import characters
from ...ui import operators, stepped
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.translations import tr
from . import bake_error, measures, worst_frames


def meant(context: bpy.types.Context, quantity: str) -> list[bpy.types.Object]:
    """Returns the targets that can show a measure."""
    if quantity in measures.BAKE_ERRORS:
        return [obj for obj in operators.targets(context) if bake_error.is_baked(obj)]
    return operators.sinew_targets(context)


class OfHeatMap:
    """An operator or a panel on what can show a heat map."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return operators.has_sinew_targets(context) or bool(meant(context, bake_error.AFTER))


class SINEW_OT_heat_map(OfHeatMap, bpy.types.Operator):
    bl_idname = "sinew.heat_map"
    bl_label = "Heat Map"
    bl_description = (
        "Show a measure of the deformation as colours, in Solid shading, in materials and in renders; once "
        "more: everything as it was. Switch errors of a bake off before an export, which would write them"
    )
    bl_options = {"REGISTER", "UNDO"}

    quantity: bpy.props.StringProperty(
        name="Measure",
        description="Its short name; empty: the one that is chosen",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if super().poll(context):
            return operators.can_change(cls)
        cls.poll_message_set(
            tr("Select a mesh that Sinew deforms or that was baked to bones, or its armature")
        )
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = measures.of(context.scene)
        quantity = self.quantity or settings.quantity
        if quantity not in measures.QUANTITIES:
            self.report({"ERROR"}, tr("There is no measure {name}", name=repr(quantity)))
            return {"CANCELLED"}
        objects = meant(context, quantity)
        if not objects:
            self.report({"ERROR"}, "No mesh here was baked to bones")
            return {"CANCELLED"}
        on = quantity != settings.quantity or not any(map(properties.shows_heat, objects))
        if quantity != settings.quantity:
            settings.quantity = quantity
        for obj in objects:
            if properties.shows_heat(obj) != on:
                properties.of(obj).heat = on
            if not on and not properties.has_sinew(obj):
                properties.clear(obj)
        return {"FINISHED"}


class _Scans(OnSinewObjects, stepped.Stepped):
    saying = "Sinew measures frames"

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        settings = measures.of(context.scene)
        return worst_frames.scan(
            context.scene, sinew_targets(context), settings.quantity, settings.other, self.over
        )


class SINEW_OT_worst_frames(_Scans, bpy.types.Operator):
    bl_idname = "sinew.worst_frames"
    bl_label = "Find Worst Frames"
    bl_description = "Go through frames and list those at which the measure is worst, one for each peak"
    bl_options = {"REGISTER"}

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    def finish(self, context: bpy.types.Context) -> set[str]:
        worst = worst_frames.scans[context.scene.session_uid].worst()
        text = tr("worst at {frame}", frame=f"{worst[0][0]:g}") if worst else tr("nothing at any frame")
        scan = worst_frames.scans[context.scene.session_uid]
        measure, count = tr(scan.metric.label), len(scan.frames)
        text = tr("{measure} over {count} frames: {result}", measure=measure, count=count, result=text)
        self.report({"INFO"}, text)
        return {"FINISHED"}


class SINEW_OT_fit_heat_range(_Scans, bpy.types.Operator):
    bl_idname = "sinew.fit_heat_range"
    bl_label = "Fit to Frames"
    bl_description = "Go through frames and fix the range so that it holds the values at all of them"
    bl_options = {"REGISTER", "UNDO"}

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    def finish(self, context: bpy.types.Context) -> set[str]:
        measures.of(context.scene).fix(worst_frames.scans[context.scene.session_uid].scale)
        return {"FINISHED"}


class SINEW_OT_go_to_frame(bpy.types.Operator):
    bl_idname = "sinew.go_to_frame"
    bl_label = "Go to Frame"
    bl_description = "Go to this frame"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    frame: bpy.props.FloatProperty(name="Frame", description="Of the scene")

    def execute(self, context: bpy.types.Context) -> set[str]:
        characters.set_frame(context.scene, self.frame)
        return {"FINISHED"}


CLASSES = (SINEW_OT_heat_map, SINEW_OT_worst_frames, SINEW_OT_fit_heat_range, SINEW_OT_go_to_frame)
