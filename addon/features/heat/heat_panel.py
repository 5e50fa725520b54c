# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's heat map, measures of the current frame, and worst frames, with their buttons."""

from collections.abc import Iterator, Sequence

import bpy

from ...attach import properties
from ...attach.subscribers import subscribers
from ...attach.updates import is_rendering_in_window
from ...base.errors import SinewError
from ...deform import characters, session
from ...io import units
from ...ui import operators, sidebar, stepped
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.settings_layout import named
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import joined, tr
from ..measure import live, worst_frames
from ..measure.metrics import Measured
from . import bake_error, measures


def meant(context: bpy.types.Context, quantity: str) -> list[bpy.types.Object]:
    """Returns the targets that can show a measure."""
    if quantity in measures.BAKE_ERRORS:
        return [obj for obj in operators.targets(context) if bake_error.is_baked(obj)]
    return operators.sinew_targets(context)


class OfHeatMap:
    """A panel on what can show a heat map."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return operators.has_sinew_targets(context) or bool(meant(context, bake_error.AFTER))


class SINEW_OT_heat_map(operators.Acting, bpy.types.Operator):
    bl_label = "Heat Map"
    bl_description = (
        "Show a measure of the deformation as colours, in Solid shading, in materials and in renders; once "
        "more: everything as it was. Switch errors of a bake off before an export, which would write them"
    )

    quantity: bpy.props.StringProperty(
        name="Measure",
        description="Its short name; empty: the one that is chosen",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        if OfHeatMap.poll(context):
            return ""
        return "Select a mesh that Sinew deforms or that was baked to bones, or its armature"

    def run(self, context: bpy.types.Context) -> None:
        settings = measures.of(context.scene)
        quantity = self.quantity or settings.quantity
        if quantity not in measures.QUANTITIES:
            raise SinewError(tr("There is no measure {name}", name=repr(quantity)))
        objects = meant(context, quantity)
        if not objects:
            raise SinewError(tr("No mesh here was baked to bones"))
        on = quantity != settings.quantity or not any(map(properties.shows_heat, objects))
        if quantity != settings.quantity:
            settings.quantity = quantity
        for obj in objects:
            if properties.shows_heat(obj) != on:
                properties.of(obj).heat = on
            if not on and not properties.has_sinew(obj):
                properties.clear(obj)


class _Scans(OnSinewObjects, stepped.Stepped):
    saying = "Sinew measures frames"

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        settings = measures.of(context.scene)
        return worst_frames.scan(
            context.scene, sinew_targets(context), settings.quantity, settings.other, self.over
        )


class SINEW_OT_worst_frames(_Scans, bpy.types.Operator):
    bl_label = "Find Worst Frames"
    bl_description = "Go through frames and list those at which the measure is worst, one for each peak"
    bl_options = {"REGISTER"}

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    def run(self, context: bpy.types.Context) -> None:
        scan = worst_frames.scans[context.scene.session_uid]
        worst = scan.worst()
        text = tr("worst at {frame}", frame=f"{worst[0][0]:g}") if worst else tr("nothing at any frame")
        measure, count = tr(scan.metric.label), len(scan.frames)
        text = tr("{measure} over {count} frames: {result}", measure=measure, count=count, result=text)
        self.report({"INFO"}, text)


class SINEW_OT_fit_heat_range(_Scans, bpy.types.Operator):
    bl_label = "Fit to Frames"
    bl_description = "Go through frames and fix the range so that it holds the values at all of them"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")

    def run(self, context: bpy.types.Context) -> None:
        measures.of(context.scene).fix(worst_frames.scans[context.scene.session_uid].scale)


class SINEW_OT_go_to_frame(operators.Named, bpy.types.Operator):
    bl_label = "Go to Frame"
    bl_description = "Go to this frame"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    frame: bpy.props.FloatProperty(name="Frame", description="Of the scene")

    def run(self, context: bpy.types.Context) -> None:
        characters.set_frame(context.scene, self.frame)


# What a frame's badness is measured by.
_WORST = {"stretch_rms": "{value} RMS", "area_rms": "{value} RMS", "flipped_area": "{value} of the area"}


class SINEW_PT_measures(Sidebar, OfHeatMap, bpy.types.Panel):
    bl_label = "Heat Map"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, measures.of(context.scene)
        objects = meant(context, settings.quantity)
        layout.active = operators.are_any_on(context) or settings.quantity in measures.BAKE_ERRORS
        shown = any(map(properties.shows_heat, objects))
        layout.operator("sinew.heat_map", icon="SHADING_RENDERED", depress=shown)
        layout.prop(settings, "quantity", text="")
        draw_text(layout, settings.metric.text)
        if settings.quantity in measures.BAKE_ERRORS and objects:
            before, after = (
                units.text(context.scene, "length", bake_error.rms(objects, quantity))
                for quantity in (bake_error.BEFORE, bake_error.AFTER)
            )
            draw_text(layout, "RMS {before} before, {after} after", before=before, after=after)
        if settings.quantity == "distance":
            column = layout.column(align=True)
            column.label(text="Compared with")
            column.prop(settings, "other", text="")
        if settings.end:
            layout.row().prop(settings, "range", expand=True)
            if settings.range == measures.FIXED:
                row = layout.row(align=True)
                row.prop(settings, settings.end)
                row.operator_menu_enum("sinew.fit_heat_range", "over", text="Fit")


class SINEW_PT_numbers(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Numbers"
    bl_parent_id = "SINEW_PT_measures"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        # Blender draws only panels that are open and visible, so nothing is measured otherwise.
        if redraw not in subscribers.frame_shown:
            subscribers.frame_shown.append(redraw)
        settings = measures.of(context.scene)
        # The last evaluation: nothing may be evaluated while drawing, as that can write.
        depsgraph = context.view_layer.depsgraph
        pairs = session.deformed_now(operators.sinew_targets(context), depsgraph)
        subject = live.measure(pairs, settings.other, depsgraph) if depsgraph is not None else None
        if subject is None:
            draw_text(self.layout, "Sinew deforms nothing here now", icon="INFO")
            return
        other = live.measured_under_other(subject, settings.other)
        shown = {properties.of(obj).method for obj, _skinned in pairs}
        heads = ["", "At Rest", shown.pop() if len(shown) == 1 else "Shown"]
        if other is not None:
            heads.append("Blender" if settings.other == properties.BLENDER else settings.other)
        column = self.layout.column(align=True)
        _draw_row(column, heads)
        for row in rows(context.scene, subject.measured, other):
            _draw_row(column, row)
        column = self.layout.column(align=True)
        column.label(text="Compared with")
        column.prop(settings, "other", text="")
        for name, value in distances(context.scene, subject.measured):
            named(column, name, factor=0.42).label(text=value)


def _draw_row(layout: bpy.types.UILayout, texts: Sequence[str]) -> None:
    values = named(layout, texts[0], factor=0.35)
    for text in texts[1:]:
        values.label(text=text)


def rows(scene: bpy.types.Scene, measured: Measured, other: Measured | None) -> list[tuple[str, ...]]:
    """Returns, for each measure of a frame, its label and its values with units: at rest, of the current
    shape and, if given, of the other method's."""
    shapes = [measured] if other is None else [measured, other]

    def row(label: str, name: str, unit: str, at_rest: str, signed: bool = False) -> tuple[str, ...]:
        values = [each.entry(name) for each in shapes]
        return label, at_rest, *(units.text(scene, unit, value, signed, short=True) for value in values)

    def rest(unit: str, value: float) -> str:
        return units.text(scene, unit, value, short=True)

    return [
        row("Volume", "volume_change", "share", rest("volume", measured.rest.volume), True),
        row("Area", "area_change", "share", rest("area", measured.rest.area), True),
        row("Least stretch", "stretch_min", "ratio", rest("ratio", 1.0)),
        row("Most stretch", "stretch_max", "ratio", rest("ratio", 1.0)),
        row("Stretch, RMS", "stretch_rms", "share", rest("share", 0.0)),
        ("Flipped faces", "0", *(f"{each.entry('flipped_faces'):,}" for each in shapes)),
        row("Dent", "bulge_min", "length", rest("length", 0.0)),
        row("Bulge", "bulge_max", "length", rest("length", 0.0), True),
    ]


def distances(scene: bpy.types.Scene, measured: Measured) -> list[tuple[str, str]]:
    """Returns the distances between the current shape and the other method's."""
    most, rms = (units.text(scene, "length", measured.entry(f"distance_{name}")) for name in ("max", "rms"))
    return [("Distance", tr("at most {value}", value=most)), ("Distance, RMS", rms)]


class SINEW_PT_worst_frames(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Worst Frames"
    bl_parent_id = "SINEW_PT_measures"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.operator_menu_enum("sinew.worst_frames", "over", text="Find", icon="VIEWZOOM")
        scan = worst_frames.scans.get(context.scene.session_uid)
        if scan is None:
            return
        methods = joined(properties.METHODS[name].label for name in scan.methods)
        measure, count = tr(scan.metric.label), len(scan.frames)
        draw_text(
            layout, "{measure}, {methods}, {count} frames", measure=measure, methods=methods, count=count
        )
        is_old = scan.basis.draw(layout, context.scene, sinew_targets(context))
        column = layout.column(align=True)
        column.active = not is_old
        unit = "length" if scan.metric.unit == "length" else "share"
        for frame, value in scan.worst():
            number = units.text(context.scene, unit, value)
            if scan.metric.worst in _WORST:
                number = tr(_WORST[scan.metric.worst], value=number)
            text = tr("Frame {frame}:  {value}", frame=f"{frame:g}", value=number)
            is_here = frame == context.scene.frame_current
            column.operator("sinew.go_to_frame", text=text, depress=is_here).frame = frame
        if not scan.worst():
            column.label(text="Nothing at any frame")


CLASSES = (
    *(SINEW_OT_heat_map, SINEW_OT_worst_frames, SINEW_OT_fit_heat_range, SINEW_OT_go_to_frame),
    SINEW_PT_measures,
    SINEW_PT_numbers,
    SINEW_PT_worst_frames,
)


def redraw() -> None:
    """Keeps the numbers up to date where Blender would not redraw them, as in playback. Called once for each
    time that they are drawn."""
    if not is_rendering_in_window():
        end()
        sidebar.redraw()


def end() -> None:
    """Has redraw() not be called again."""
    if redraw in subscribers.frame_shown:
        subscribers.frame_shown.remove(redraw)
