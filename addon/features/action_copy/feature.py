# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of actions that Sinew keys: their record, and the operator that plays the original again."""

import bpy

from ...attach.feature import Feature
from ...deform import characters
from ...ui import operators
from . import action_copy


class OnArmature(operators.Acting):
    """A base class of operators on the armatures of the selection."""

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "" if operators.armatures(context) else "Select an armature"


def selected_bones(armature: bpy.types.Object) -> list[str] | None:
    """Returns the bones that are selected in pose mode; None, which means all, in other modes and without a
    selection."""
    if armature.mode != "POSE":
        return None
    # Of bones up to Blender 4.5, of pose bones since 5.0.
    return [b.name for b in armature.pose.bones if (b if hasattr(b, "select") else b.bone).select] or None


class SINEW_OT_original_action(operators.Acting, bpy.types.Operator):
    bl_label = "Original Action"
    bl_description = "Play the action that was there before Sinew keyed a copy; the copy goes"

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        is_any = any(map(action_copy.is_on, operators.armatures(context)))
        return "" if is_any else "Sinew has keyed no copy of this armature's action"

    def run(self, context: bpy.types.Context) -> None:
        for armature in filter(action_copy.is_on, operators.armatures(context)):
            action_copy.restore(armature)
        characters.set_frame(context.scene, context.scene.frame_float)


FEATURE = Feature(
    (action_copy.SinewActionCopy, SINEW_OT_original_action),
    {"Action.sinew_copy": bpy.props.PointerProperty(type=action_copy.SinewActionCopy)},
)
