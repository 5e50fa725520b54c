# SPDX-License-Identifier: GPL-3.0-or-later
"""A range of motion: its operators, and a panel that goes to its poses."""

import bpy

from ...attach import properties
from ...attach.feature import Feature
from ...attach.subscribers import subscribers
from ...base.errors import SinewError
from ...deform import session
from ...ui import operators
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.sidebar import Sidebar, draw_text
from ...ui.translations import counted
from . import clip


def _armatures(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Those that deform the meshes of the selection."""
    found = (armature for obj in sinew_targets(context) for armature in properties.of(obj).armatures)
    return list(dict.fromkeys(found))


class SINEW_OT_motion_range(OnSinewObjects, bpy.types.Operator):
    bl_label = "Range of Motion"
    bl_description = (
        "Have the character play stated poses, with rest in between: elbows, wrists, shoulders, hips, knees, "
        "neck, back and hands bent and twisted by known angles. Its own action, strips, drivers, constraints "
        "and pose come back by End, by undo, and before the file is saved"
    )

    def run(self, context: bpy.types.Context) -> None:
        meshes, armatures = sinew_targets(context), _armatures(context)
        for armature in armatures:
            clip.check(armature)
        count = 0
        with session.changing(context):
            for armature in armatures:
                if not clip.is_on(armature):
                    count = max(count, len(clip.start(context.scene, armature, meshes)))
        if not count:
            raise SinewError("It plays its range of motion already")
        context.scene.frame_set(clip.FIRST + clip.STEP)
        self.report({"INFO"}, counted(count, "{count} pose", "{count} poses"))


class _WhileOn(operators.Acting):
    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "" if clip.armatures_on() else "No range of motion is played"


class SINEW_OT_end_motion_range(_WhileOn, bpy.types.Operator):
    bl_label = "End Range of Motion"
    bl_description = (
        "Put the action, strips, drivers, constraints and pose of the character back as they were"
    )

    keep: bpy.props.BoolProperty(
        name="Keep",
        description="Keep the poses as an action of its own in the file",
        options={"SKIP_SAVE"},
    )

    def run(self, context: bpy.types.Context) -> None:
        with session.changing(context):
            _end(self.keep)


class SINEW_OT_motion_range_pose(_WhileOn, bpy.types.Operator):
    bl_label = "Go to Pose"
    bl_description = "Show this pose of the range of motion"
    # As a change of the frame.
    bl_options = {"REGISTER", "INTERNAL"}

    frame: bpy.props.IntProperty(options={"HIDDEN"})

    def run(self, context: bpy.types.Context) -> None:
        context.scene.frame_set(self.frame)


class SINEW_PT_motion_range(Sidebar, bpy.types.Panel):
    bl_label = "Range of Motion"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(clip.armatures_on()) or operators.has_sinew_targets(context)

    def draw(self, context: bpy.types.Context) -> None:
        layout, armatures = self.layout, clip.armatures_on()
        if not armatures:
            layout.operator("sinew.motion_range", icon="ARMATURE_DATA")
            return
        draw_text(layout, "The character's own motion comes back by End", icon="INFO")
        row = layout.row(align=True)
        row.operator("sinew.end_motion_range", text="End", icon="X")
        row.operator("sinew.end_motion_range", text="Keep Action", icon="FAKE_USER_OFF").keep = True
        column = layout.column(align=True)
        for name, frame in max(map(clip.poses_on, armatures), key=len):
            is_shown = context.scene.frame_current == frame
            column.operator("sinew.motion_range_pose", text=name, depress=is_shown).frame = frame


def _end(keep: bool = False) -> None:
    for armature in clip.armatures_on():
        clip.restore(armature, keep)


FEATURE = Feature(
    (
        clip.SinewMotionRange,
        SINEW_OT_motion_range,
        SINEW_OT_end_motion_range,
        SINEW_OT_motion_range_pose,
        SINEW_PT_motion_range,
    ),
    {"Object.sinew_motion_range": bpy.props.PointerProperty(type=clip.SinewMotionRange)},
    subscriptions=((subscribers.saving, _end),),
)
