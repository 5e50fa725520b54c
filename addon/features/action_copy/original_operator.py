# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that plays the original action again, and what operators that replace it share."""

from __future__ import annotations

import bpy

from ...deform import characters
from ...ui import operators
from ...ui.translations import tr
from . import action_copy


class OnArmature:
    """A base class of operators on the armatures of the selection."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if operators.armatures(context):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Select an armature"))
        return False


def selected_bones(armature: bpy.types.Object) -> list[str] | None:
    """Returns the bones that are selected in pose mode; None, which means all, in other modes and without a
    selection."""
    if armature.mode != "POSE":
        return None
    # Of bones up to Blender 4.5, of pose bones since 5.0.
    return [b.name for b in armature.pose.bones if (b if hasattr(b, "select") else b.bone).select] or None


class SINEW_OT_original_action(bpy.types.Operator):
    bl_idname = "sinew.original_action"
    bl_label = "Original Action"
    bl_description = (
        "Play the action that was there before Sinew keyed a copy, with its IK constraints; the copy goes"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(map(action_copy.is_on, operators.armatures(context))):
            return operators.can_change(cls)
        cls.poll_message_set(tr("Sinew has keyed no copy of this armature's action"))
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        for armature in filter(action_copy.is_on, operators.armatures(context)):
            action_copy.restore(armature)
        characters.set_frame(context.scene, context.scene.frame_float)
        return {"FINISHED"}


CLASSES = (SINEW_OT_original_action,)
