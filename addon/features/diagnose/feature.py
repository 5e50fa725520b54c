# SPDX-License-Identifier: GPL-3.0-or-later
"""Diagnostics: a panel with faults of weights and poses, what to do about them, and where they are;
handlers that forget findings when weights change."""

from collections.abc import Iterator

import bpy

from ...attach import attach
from ...attach.feature import Feature
from ...attach.layout import read as read_stack
from ...base.errors import SinewError
from ...ui import operators, stepped
from ...ui.sidebar import Sidebar, characters, draw_text, names_text, shortened
from ...ui.translations import counted, tip, tr
from ..measure.diagnostics import Finding
from . import diagnose, mending

NAMES_SHOWN = 5


def _checkable(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in operators.targets(context) if attach.armature_of(obj) is not None]


class SINEW_OT_check(operators.OnDeformed, bpy.types.Operator):
    bl_label = "Check"
    bl_description = "Look for faults in the weights, and for what dual quaternions do in the pose of now"
    bl_options = {"REGISTER"}

    def run(self, context: bpy.types.Context) -> None:
        diagnose.check(context.scene, _checkable(context), context.scene.sinew_most_influences)
        _report(self, context)


class SINEW_OT_check_frames(operators.OnDeformed, stepped.Stepped, bpy.types.Operator):
    bl_label = "Check over Frames"
    bl_description = (
        "Look for faults in the weights, and for what dual quaternions do in the poses of all frames"
    )
    bl_options = {"REGISTER"}

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="ACTION")
    saying = "Sinew checks poses"

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        scene = context.scene
        return diagnose.check_frames(scene, _checkable(context), scene.sinew_most_influences, self.over)

    def run(self, context: bpy.types.Context) -> None:
        _report(self, context)


def _report(operator: bpy.types.Operator, context: bpy.types.Context) -> None:
    kinds = sum(len(diagnose.of(obj).findings) for obj in _checkable(context))
    text = counted(kinds, "{count} kind of fault", "{count} kinds of faults") if kinds else "Nothing found"
    operator.report({"INFO"}, text)


class _OnFinding(operators.Acting):
    """An operator on a finding of a mesh."""

    object: bpy.props.StringProperty(options={"HIDDEN"})
    finding: bpy.props.StringProperty(options={"HIDDEN"})

    def mesh(self, context: bpy.types.Context) -> bpy.types.Object:
        obj = context.scene.objects.get(self.object)
        if obj is None:
            raise SinewError(tr("{name} is not in this scene any more; press Check again", name=self.object))
        return obj


class SINEW_OT_select_finding(_OnFinding, bpy.types.Operator):
    bl_label = "Select"
    bl_description = (
        "Select exactly these vertices, in edit mode or weight paint mode, and look at them; hidden ones are "
        "shown"
    )
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def run(self, context: bpy.types.Context) -> None:
        obj = self.mesh(context)
        _check, finding = diagnose.finding_of(obj, self.finding)
        diagnose.select_vertices(obj, finding.vertices, context, finding.bone)
        count = len(finding.vertices)
        self.report({"INFO"}, counted(count, "Selected {count} vertex", "Selected {count} vertices"))


class SINEW_OT_mend(_OnFinding, bpy.types.Operator):
    bl_label = "Mend"
    bl_description = (
        "Mend this fault, on exactly these vertices, and check again. Locked groups stay as they are"
    )
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    how: bpy.props.EnumProperty(
        name="How",
        description="What to do",
        items=[(each.name, each.label, each.description) for each in mending.ALL.values()],
        options={"HIDDEN"},
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, given: bpy.types.OperatorProperties) -> str:
        text = tip("{what}; then check again. Locked groups stay as they are")
        return text.format(what=tip(mending.ALL[given.how].description))

    def run(self, context: bpy.types.Context) -> None:
        scene, manager, obj = context.scene, context.window_manager, self.mesh(context)
        most = scene.sinew_most_influences
        manager.progress_begin(0.0, 1.0)
        try:
            done = mending.mend(obj, self.finding, self.how, most)
            diagnose.forget_place(obj, self.finding)
            for share in diagnose.check_again(scene, obj, most):
                manager.progress_update(share)
        finally:
            manager.progress_end()
        left = next((each.count for each in diagnose.of(obj).findings if each.key == self.finding), 0)
        text = tr("Mended {what}. Checked again: {count} left", what=done, count=f"{left:,}")
        self.report({"INFO"}, text)


class SINEW_PT_diagnostics(Sidebar, bpy.types.Panel):
    bl_label = "Diagnostics"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(_checkable(context))

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.prop(context.scene, "sinew_most_influences")
        row = layout.row(align=True)
        row.operator("sinew.check", icon="CHECKMARK")
        row.operator_menu_enum("sinew.check_frames", "over", text="Over Frames")
        checks = [(obj, diagnose.of(obj)) for obj in _checkable(context)]
        known = [(obj, found) for obj, found in checks if found is not None]
        clean = [obj.name for obj, found in known if not (found.findings or found.stale)]
        for obj, found in known:
            if len(known) == 1 or obj.name not in clean:
                _draw_check(layout.box(), obj, found)
        if clean and len(known) > 1:
            draw_text(layout, "Nothing found: {names}", icon="CHECKMARK", names=names_text(clean))


def _draw_check(layout: bpy.types.UILayout, obj: bpy.types.Object, found: diagnose.Check) -> None:
    name = shortened(obj.name, characters() - 8)
    layout.label(text=name, icon="OUTLINER_OB_MESH", translate=False)
    if found.stale:
        text = "Weights, groups or bones have changed since: press Check again"
        draw_text(layout, text, icon="FILE_REFRESH", alert=True)
    column = layout.column()
    column.active = not found.stale
    for finding in found.findings:
        _draw_finding(column, obj, finding)
    if not found.findings:
        column.label(text="Nothing found", icon="CHECKMARK")
    draw_text(column, "Checked: weights, {poses}", poses=found.frames)
    upstream = [modifier.name for modifier in read_stack(obj).changes_ahead]
    if upstream:
        names = ", ".join(upstream)
        what = "What {names} in front makes of the mesh is not checked: it has no vertices to select"
        text = tr(what, names=names)
        draw_text(column, text, icon="INFO")


def _draw_finding(layout: bpy.types.UILayout, obj: bpy.types.Object, finding: Finding) -> None:
    what = f"{tr(finding.title)}: {finding.count:,}"
    draw_text(layout, f"{finding.bone}: {what}" if finding.bone else what, icon="ERROR")
    if finding.groups:
        draw_text(layout, names_text(finding.groups, NAMES_SHOWN))
    draw_text(layout, finding.advice)
    if len(finding.vertices):
        text = counted(len(finding.vertices), "Select {count} Vertex", "Select {count} Vertices")
        button = layout.operator("sinew.select_finding", text=text, icon="RESTRICT_SELECT_OFF")
        button.object, button.finding = obj.name, finding.key
    mending.draw(layout, obj, finding.name, finding.key)
    layout.separator(factor=0.5)


FEATURE = Feature(
    (
        SINEW_OT_check,
        SINEW_OT_check_frames,
        SINEW_OT_select_finding,
        SINEW_OT_mend,
        SINEW_PT_diagnostics,
    ),
    subscriptions=diagnose.SUBSCRIPTIONS,
    end=diagnose.forget,
)
