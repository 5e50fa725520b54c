# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of inverse kinematics in the sidebar, and its buttons."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from ...core import ik as core
from ...core.errors import SinewError
from ...deform import evaluate
from ...io import ik_io
from ...ui import operators, stepped
from ...ui.sidebar import Sidebar, draw_armature, draw_text, names_text
from ...ui.translations import tr
from . import ik_bake, ik_live
from .ik_records import live_constraints


def _selected(armature: bpy.types.Object) -> list[str] | None:
    """Returns the bones that are selected in pose mode; None, which means all, in other modes and without a
    selection."""
    if armature.mode != "POSE":
        return None
    # Of bones up to Blender 4.5, of pose bones since 5.0.
    return [b.name for b in armature.pose.bones if (b if hasattr(b, "select") else b.bone).select] or None


class _OnArmature:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if operators.armatures(context):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Select an armature"))
        return False


class SINEW_OT_bake_ik(_OnArmature, stepped.Stepped, bpy.types.Operator):
    bl_idname = "sinew.bake_ik"
    bl_label = "Bake Sinew IK"
    bl_description = (
        "Solve the IK constraints of the selected bones' chains, or of all, by Sinew, and key the result in "
        "a copy of the action; the constraints are muted until Remove"
    )
    bl_options = {"REGISTER", "UNDO"}

    saying = "Sinew solves inverse kinematics"

    method: bpy.props.EnumProperty(
        name="Method",
        description="How the rotations are found",
        items=[(name, label, text) for name, (label, text) in core.LABELS.items()],
    )
    over: bpy.props.EnumProperty(**stepped.OVER_WHICH)

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = operators.armatures(context)[0]
        frames = stepped.frames_over(context.scene, [armature], self.over)
        self._found: list[ik_bake.Baked] = []
        with ik_live.suspended(armature), stepped.kept_frame(context.scene, [armature]):
            trees = ik_io.read_trees(armature, _selected(armature))
            yield from ik_bake.steps(armature, trees, frames, self.method, self._found)

    def finish(self, context: bpy.types.Context) -> set[str]:
        # The baked action applies at the current frame, too.
        evaluate.set_frame(context.scene, context.scene.frame_float)
        bones = sum(len(each.tree.bones) for each in self._found)
        worst = max(float(np.max(each.errors)) for each in self._found)
        text = tr(
            "{count} bones keyed; the tips are at most {share} of a chain's length off",
            count=bones,
            share=f"{worst:.2%}",
        )
        self.report({"INFO"}, text)
        return {"FINISHED"}


class SINEW_OT_live_ik(_OnArmature, bpy.types.Operator):
    bl_idname = "sinew.live_ik"
    bl_label = "Live"
    bl_description = (
        "Have Sinew solve the IK constraints of the selected bones' chains, or of all, in each evaluation, "
        "without keys; again: have Blender solve them. The constraints are muted meanwhile, and their "
        "settings go on counting"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = operators.armatures(context)[0]
        meant = _selected(armature)
        try:
            live = live_constraints(armature)
            trees = ik_io.read_trees(armature, meant, live)
            if all(_is_live(tree, live) for tree in trees):
                ik_live.switch_off(armature, meant)
            else:
                ik_live.switch_on(armature, meant)
        except SinewError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        problem = ik_live.problem_of(armature)
        if problem:
            self.report({"WARNING"}, tr(problem))
        return {"FINISHED"}


class SINEW_OT_remove_ik(bpy.types.Operator):
    bl_idname = "sinew.remove_ik"
    bl_label = "Remove Sinew IK"
    bl_description = "Give back the action and the IK constraints that were there before Live and the bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(map(_has_sinew_ik, operators.armatures(context))):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Nothing is live or baked by Sinew IK here"))
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        for armature in filter(_has_sinew_ik, operators.armatures(context)):
            ik_live.switch_off(armature)
            if ik_bake.is_baked(armature):
                ik_bake.restore(armature)
        evaluate.set_frame(context.scene, context.scene.frame_float)
        return {"FINISHED"}


class SINEW_PT_ik(Sidebar, bpy.types.Panel):
    bl_label = "Inverse Kinematics"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(operators.armatures(context))

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        armature = operators.armatures(context)[0]
        box = layout.box()
        draw_armature(box, context, armature)
        live, problem = live_constraints(armature), ik_live.problem_of(armature)
        try:
            trees = ik_io.read_trees(armature, _selected(armature), live)
        except SinewError as error:
            if not problem:
                draw_text(box, context, str(error), icon="INFO")
            trees = []
        for tree in trees:
            text = tr("{count} bones to {names}", count=len(tree.bones), names=names_text(_tips(tree)))
            if _is_live(tree, live) and not problem:
                text = tr("{chain}: live", chain=text)
            draw_text(box, context, text, icon="CON_KINEMATIC")
        if problem:
            draw_text(box, context, problem, icon="ERROR", alert=True)
        if trees:
            are_live = all(_is_live(tree, live) for tree in trees)
            layout.operator("sinew.live_ik", icon="RECORD_ON" if are_live else "RECORD_OFF", depress=are_live)
        if live:
            column = layout.column()
            column.use_property_split = True
            column.use_property_decorate = False
            column.prop(armature.sinew_ik, "method")
            column.prop(armature.sinew_ik, "iterations")
        if trees:
            layout.operator_menu_enum("sinew.bake_ik", "method", icon="KEYTYPE_BREAKDOWN_VEC")
        if ik_bake.is_baked(armature):
            draw_text(box, context, "Keys of Sinew IK play; its constraints are muted", icon="CHECKMARK")
        if _has_sinew_ik(armature):
            layout.operator("sinew.remove_ik", icon="X")


def _tips(tree: core.Tree) -> list[str]:
    return [tree.bones[effector.bone] for effector in tree.effectors]


def _is_live(tree: core.Tree, live: dict[str, str]) -> bool:
    return all(bone in live for bone, _name in tree.constraints)


def _has_sinew_ik(armature: bpy.types.Object) -> bool:
    return ik_live.is_live(armature) or ik_bake.is_baked(armature)


CLASSES = (ik_bake.SinewIkBake, SINEW_OT_bake_ik, SINEW_OT_live_ik, SINEW_OT_remove_ik, SINEW_PT_ik)
