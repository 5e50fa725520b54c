# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of in-betweens in the sidebar, and its button."""

from __future__ import annotations

import bpy

from ...core import inbetween as core_inbetween
from ...core.errors import SinewError
from ...ui import operators
from ...ui.sidebar import Sidebar, draw_armature, draw_text
from ...ui.translations import tr
from . import inbetween, inbetween_bake, inbetween_handlers


class SINEW_OT_bake_inbetweens(bpy.types.Operator):
    bl_idname = "sinew.bake_inbetweens"
    bl_label = "Bake In-betweens"
    bl_description = (
        "Write the in-betweens as plain keys into a copy of the action, which plays without Sinew; the "
        "action itself stays in the file"
    )
    bl_options = {"REGISTER", "UNDO"}

    step: bpy.props.IntProperty(
        name="Step", description="Frames from one baked key to the next", default=1, min=1, soft_max=12
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(inbetween.is_on(armature) for armature in operators.armatures(context)):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Choose a method for the in-betweens of a selected armature"))
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        baked = []
        try:
            for armature in filter(inbetween.is_on, operators.armatures(context)):
                try:
                    baked.append(inbetween_bake.bake(armature, self.step, manager.progress_update))
                except SinewError as error:
                    self.report({"ERROR"}, str(error))
        finally:
            manager.progress_end()
        if not baked:
            return {"CANCELLED"}
        names = (
            tr("{count} bones into {action}", count=each.bones, action=each.action.name) for each in baked
        )
        self.report({"INFO"}, tr("Baked {names}", names=", ".join(names)))
        return {"FINISHED"}


class SINEW_PT_inbetweens(Sidebar, bpy.types.Panel):
    bl_label = "In-betweens"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(operators.armatures(context))

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        armatures = operators.armatures(context)
        for armature in armatures:
            box = layout.box()
            draw_armature(box, context, armature)
            box.prop(armature, "sinew_inbetween", text="")
            if inbetween.is_on(armature):
                box.row().prop(armature, "sinew_inbetween_path", expand=True)
                _draw_playing(box, context, armature)
        if any(inbetween.is_on(armature) for armature in armatures):
            layout.operator("sinew.bake_inbetweens", icon="KEYTYPE_BREAKDOWN_VEC")


def _draw_playing(layout: bpy.types.UILayout, context: bpy.types.Context, armature: bpy.types.Object) -> None:
    draw_text(layout, context, core_inbetween.METHODS[armature.sinew_inbetween].description)
    problem = inbetween_handlers.problem_of(armature)
    player = inbetween_handlers.player_of(armature)
    if problem is not None:
        draw_text(layout, context, problem, icon="ERROR", alert=True)
    elif player is None or not player.bones:
        draw_text(layout, context, "Key poses of bones: Sinew moves them between the keys", icon="INFO")
    else:
        what = "Plays {played} of {count} bones; meanwhile their curves are muted"
        text = tr(what, played=player.bones, count=len(armature.pose.bones))
        draw_text(layout, context, text, icon="INFO")
    if player is not None:
        for bone, reason in sorted(player.left.items()):
            text = tr("{bone} {reason}: Blender's curves play", bone=bone, reason=tr(reason))
            draw_text(layout, context, text, icon="ERROR")
        if player.pose is not None and player.pose.far:
            names = ", ".join(player.pose.far)
            reason = core_inbetween.TOO_FAR[armature.sinew_inbetween_path]
            draw_text(layout, context, f"{names} {tr(reason)}", icon="ERROR")


CLASSES = (SINEW_OT_bake_inbetweens, SINEW_PT_inbetweens)
