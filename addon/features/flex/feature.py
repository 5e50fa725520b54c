# SPDX-License-Identifier: GPL-3.0-or-later
"""Flex: a panel with the joints that do not deform well, and for each fault its place and its pose."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ...attach import properties, variant_settings
from ...attach.feature import Feature
from ...attach.layout import read as read_stack
from ...attach.subscribers import subscribers
from ...base.errors import SinewError
from ...skinning.variants import Variant, parse
from ...ui import character, operators, stepped
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.sidebar import Sidebar, draw_text, names_text
from ...ui.translations import tr
from ..diagnose import diagnose, mending
from ..measure import diagnostics
from ..measure.limits import Table
from ..measure.worst_frames import check_measurable
from ..pages.save import SavesPage
from ..variants import choices
from . import flex, page
from .verdict import Finding, Joint

FAULTS_SHOWN = 8

# By the session_uid of the scene. Nothing is stored in files.
results: dict[int, flex.Result] = {}


class SINEW_OT_flex(OnSinewObjects, stepped.Stepped, bpy.types.Operator):
    bl_label = "Flex"
    bl_description = (
        "Bend every joint of the character by itself, beside its pose, and list those that do not deform well"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew bends every joint"

    others: bpy.props.BoolProperty(
        name="Try Variants",
        description="Also try the other variants of the character, and say which mend a joint",
        options={"SKIP_SAVE"},
    )

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        objects = sinew_targets(context)
        check_measurable(objects)
        shown = [variant_settings.read(obj) for obj in objects]
        tried = choices.of_character(context) if self.others else ()
        others = [each.key for each in tried if not all(map(each.agrees_with, shown))]
        self.result = yield from flex.flex(objects, others, Table(), {})

    def run(self, context: bpy.types.Context) -> None:
        scene = context.scene
        results[scene.session_uid] = self.result
        objects = sinew_targets(context)
        diagnose.check(scene, objects, scene.sinew_most_influences)
        for obj in objects:
            diagnose.keep_places(obj, list(_places_on(obj, self.result)))
        self.report({"INFO"}, _headline(self.result))


def _places_on(obj: bpy.types.Object, result: flex.Result) -> Iterator[diagnostics.Finding]:
    """Yields the patches of a mesh that can be mended."""
    if read_stack(obj).changes_ahead:
        return
    for own, _others in result.verdict.by_cause():
        limit = own.limit
        if obj.name in own.patch:
            patch = own.patch[obj.name]
            yield diagnostics.Finding(
                limit.name, limit.label, patch, limit.meaning, limit.advice, bone=own.joint
            )


class _OnFinding(operators.Acting):
    """An operator on a fault of a joint: that of the list, by their numbers."""

    joint: bpy.props.IntProperty(options={"HIDDEN"})
    finding: bpy.props.IntProperty(options={"HIDDEN"})

    def found(self, context: bpy.types.Context) -> tuple[flex.Result, Joint, Finding]:
        result = results.get(context.scene.session_uid)
        try:
            joint = result.verdict.joints[self.joint]
            return result, joint, joint.findings[self.finding]
        except (AttributeError, IndexError):
            raise SinewError("No such fault is known; press Flex again") from None


class SINEW_OT_flex_place(_OnFinding, bpy.types.Operator):
    bl_label = "Select"
    bl_description = (
        "Select the vertices where this is worst, in edit mode or weight paint mode, and look at them"
    )
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def run(self, context: bpy.types.Context) -> None:
        _result, joint, finding = self.found(context)
        obj = context.scene.objects.get(finding.mesh)
        if obj is None or finding.vertex >= len(obj.data.vertices) or read_stack(obj).changes_ahead:
            raise SinewError(f"{finding.mesh} has other vertices than those that were bent")
        if not obj.data.is_editable:
            raise SinewError(f"{obj.name}: its mesh is linked from another file and can only be edited there")
        diagnose.select_vertices(obj, finding.patch[finding.mesh], context, joint.name)


class SINEW_OT_flex_pose(_OnFinding, bpy.types.Operator):
    bl_label = "Pose"
    bl_description = (
        "Rotate these bones as they were when this was found; keys stay as they are. Undo takes it back"
    )
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def run(self, context: bpy.types.Context) -> None:
        result, joint, finding = self.found(context)
        armature = context.scene.objects.get(joint.armature)
        rotations = result.poses.get((joint.armature, joint.name, finding.pose), {})
        bones = armature.pose.bones if armature is not None and armature.pose is not None else {}
        if not rotations or not set(rotations) <= set(bones.keys()):
            raise SinewError("No such fault is known; press Flex again")
        for name, rotation in rotations.items():
            own = bones[name]
            axes = np.array(own.bone.matrix_local)[:3, :3]
            location, _rotation, scale = own.matrix_basis.decompose()
            turned = Matrix((np.linalg.inv(axes) @ rotation @ axes).tolist()).to_quaternion()
            own.matrix_basis = Matrix.LocRotScale(location, turned, scale)
        if any(not constraint.mute for name in rotations for constraint in bones[name].constraints):
            self.report({"WARNING"}, "Constraints hold these bones: pose their controls instead")


class SINEW_OT_save_flex(SavesPage, bpy.types.Operator):
    bl_label = "Save as Page"
    bl_description = (
        "Save one HTML file in which the character turns in any browser, bent as it was here; a click on a "
        "fault goes to its place"
    )
    bl_options = {"REGISTER"}
    saying = "Sinew bends every joint"
    usual_name = "flex"

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "" if context.scene.session_uid in results else "Bend every joint first"

    def page(self, context: bpy.types.Context, title: str) -> Generator[float, None, str]:
        result, found = results[context.scene.session_uid], context.scene.objects
        objects = [found[name] for name in result.own if name in found]
        if len(objects) < len(result.own) or not all(map(properties.has_sinew, objects)):
            raise SinewError("A mesh that was bent is gone; press Flex again")
        if result.basis.changes(context.scene, objects):
            raise SinewError("The character has changed since it was bent; press Flex again")
        return page.page(context.scene, title, objects, result)


class SINEW_PT_flex(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Flex"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.active = operators.are_any_on(context)
        row = layout.row(align=True)
        if not stepped.draw_progress(row, "sinew.flex"):
            row.operator("sinew.flex", text="Bend Every Joint", icon="CON_ROTLIMIT")
            row.operator("sinew.flex", text="Try Variants").others = True
        result = results.get(context.scene.session_uid)
        if result is None:
            return
        is_old = result.basis.draw(layout, context.scene, sinew_targets(context))
        layout = layout.column()
        layout.active = not is_old
        is_good = result.verdict.is_good
        draw_text(layout, _headline(result), icon="CHECKMARK" if is_good else "ERROR")
        if not stepped.draw_progress(layout, SINEW_OT_save_flex.bl_idname):
            layout.operator("sinew.save_flex", icon="URL")
        places = {
            id(finding): (number, place)
            for number, joint in enumerate(result.verdict.joints)
            for place, finding in enumerate(joint.findings)
        }
        lead = character.lead(context)
        now = variant_settings.read(lead) if lead is not None else None
        faults, told = result.verdict.by_cause(), set()
        shown = len(faults) if context.scene.sinew_all_faults else FAULTS_SHOWN
        for own, others in faults[:shown]:
            _draw_fault(layout.box().column(), context, places, own, others, told, now)
        if len(faults) > FAULTS_SHOWN:
            text = tr("Show All {count}", count=len(faults))
            layout.prop(context.scene, "sinew_all_faults", text=text, translate=False, toggle=True)


def _headline(result: flex.Result) -> str:
    joints = result.verdict.joints
    return tr(
        "{good} of {count} joints deform well", good=sum(each.is_good for each in joints), count=len(joints)
    )


def _draw_fault(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    places: Mapping[int, tuple[int, int]],
    own: Finding,
    others: Sequence[Finding],
    told: set[str],
    now: Variant | None,
) -> None:
    """
    places  of findings in the list, by their id
    others  those that come from it
    told    names of limits whose advice is above
    now     what deforms the character
    """
    limit, key = own.limit, f"{own.limit.name} {own.joint}"
    layout.label(text=own.joint, icon="BONE_DATA", translate=False)
    _draw_place(layout, places[id(own)], own)
    shown = filter(None, map(context.scene.objects.get, own.patch))
    mended = [obj for obj in shown if limit.name in mending.MENDS and diagnose.has(obj, key)]
    if own.mends:
        layout.label(text="Not under", icon="SOLO_ON")
        column = layout.column(align=True)
        for text in own.mends:
            choices.draw_use(column, parse(text), now)
    elif limit.name not in told:
        told.add(limit.name)
        draw_text(layout, tr(limit.meaning))
        if not mended:
            draw_text(layout, tr(limit.advice))
    for obj in mended:
        mending.draw(layout, obj, limit.name, key)
    if others:
        draw_text(
            layout, "From it, at {joints}:", joints=names_text(_unique(each.joint for each in others), 4)
        )
        draw_text(layout, ", ".join(tr(label) for label in _unique(each.limit.label for each in others)))


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _draw_place(layout: bpy.types.UILayout, place: tuple[int, int], finding: Finding) -> None:
    limit = finding.limit
    text = tr(limit.label)
    if limit.name != "inert":
        text = tr("{what}: {value}", what=text, value=f"{limit.number(finding.value)} {tr(limit.unit)}")
    row = layout.row(align=True)
    buttons = bool(finding.pose) + bool(finding.mesh)
    draw_text(row.column(), text, beside=buttons)
    if finding.pose:
        button = row.operator("sinew.flex_pose", text="", icon="ARMATURE_DATA")
        button.joint, button.finding = place
    if finding.mesh:
        button = row.operator("sinew.flex_place", text="", icon="RESTRICT_SELECT_OFF")
        button.joint, button.finding = place


FEATURE = Feature(
    (SINEW_OT_flex, SINEW_OT_flex_place, SINEW_OT_flex_pose, SINEW_OT_save_flex, SINEW_PT_flex),
    {
        "Scene.sinew_all_faults": bpy.props.BoolProperty(
            name="Show All Faults", description="Show all faults that Flex found, not the first few alone"
        )
    },
    subscriptions=((subscribers.loading, results.clear),),
    end=results.clear,
)
