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
from . import ik_bake


def _selected(armature: bpy.types.Object) -> list[str] | None:
    """The bones that are selected in pose mode; None elsewhere, and where none are: all."""
    if armature.mode != "POSE":
        return None
    # Of bones up to Blender 4.5, of pose bones since 5.0.
    return [b.name for b in armature.pose.bones if (b if hasattr(b, "select") else b.bone).select] or None


class SINEW_OT_bake_ik(stepped.Stepped, bpy.types.Operator):
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

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if operators.armatures(context):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Select an armature"))
        return False

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = operators.armatures(context)[0]
        trees = ik_io.read_trees(armature, _selected(armature))
        frames = stepped.frames_over(context.scene, [armature], self.over)
        self._found: list[ik_bake.Baked] = []
        with stepped.kept_frame(context.scene, [armature]):
            yield from ik_bake.steps(armature, trees, frames, self.method, self._found)

    def finish(self, context: bpy.types.Context) -> set[str]:
        # The baked action has its say on the frame that the scene is at.
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


class SINEW_OT_remove_ik(bpy.types.Operator):
    bl_idname = "sinew.remove_ik"
    bl_label = "Remove Sinew IK"
    bl_description = "Give back the action and the IK constraints that were there before the bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(ik_bake.is_baked(armature) for armature in operators.armatures(context)):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Nothing is baked by Sinew IK here"))
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        for armature in filter(ik_bake.is_baked, operators.armatures(context)):
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
        try:
            trees = ik_io.read_trees(armature, _selected(armature))
        except SinewError as error:
            draw_text(box, context, str(error), icon="INFO")
            trees = []
        for tree in trees:
            text = tr("{count} bones to {names}", count=len(tree.bones), names=names_text(_tips(tree)))
            draw_text(box, context, text, icon="CON_KINEMATIC")
        if trees:
            layout.operator_menu_enum("sinew.bake_ik", "method", icon="KEYTYPE_BREAKDOWN_VEC")
        if ik_bake.is_baked(armature):
            draw_text(box, context, "Keys of Sinew IK play; its constraints are muted", icon="CHECKMARK")
            layout.operator("sinew.remove_ik", icon="X")


def _tips(tree: core.Tree) -> list[str]:
    return [tree.bones[effector.bone] for effector in tree.effectors]


CLASSES = (ik_bake.SinewIkBake, SINEW_OT_bake_ik, SINEW_OT_remove_ik, SINEW_PT_ik)
