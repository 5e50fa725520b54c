# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of blends of actions in the sidebar, and its buttons."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
from bpy_extras.io_utils import ImportHelper

from ...core.errors import SinewError
from ...core.motion.blend import METHODS, TRAVEL
from ...io import clips
from ...ui import operators, stepped
from ...ui.sidebar import Sidebar, draw_armature, draw_text
from ...ui.translations import counted, tr
from . import blend_actions, blend_settings


def armature_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature whose actions are blended: the active one, or the one of the active mesh."""
    return next(iter(operators.armatures(context)), None)


class _OfArmature:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        armature = armature_of(context)
        if armature is None:
            cls.poll_message_set(tr("Select an armature, or a mesh that it deforms"))
            return False
        if not armature.is_editable:
            text = tr("{name} is linked: make a library override of it first", name=armature.name)
            cls.poll_message_set(text)
            return False
        return operators.can_change(cls)


class SINEW_OT_blend_add_clip(_OfArmature, bpy.types.Operator):
    bl_idname = "sinew.blend_add_clip"
    bl_label = "Add Action"
    bl_description = "Add an action to the blend: the one that plays, or the next that moves these bones"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = armature_of(context)
        chosen = armature.sinew_blend.clips
        taken = [clip.action for clip in chosen]
        playing = armature.animation_data.action if armature.animation_data is not None else None
        left = [action for action in (playing, *bpy.data.actions) if action is not None]
        left = [a for a in left if a not in taken and clips.keyed_properties(armature, a)]
        chosen.add().action = left[0] if left else None
        return {"FINISHED"}


class SINEW_OT_blend_remove_clip(_OfArmature, bpy.types.Operator):
    bl_idname = "sinew.blend_remove_clip"
    bl_label = "Remove Action"
    bl_description = "Take the action out of the blend; the action itself stays in the file"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    index: bpy.props.IntProperty(description="Which of the blend's actions", options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = armature_of(context)
        blend = blend_settings.of(armature)
        if blend is None or not 0 <= self.index < len(blend.clips):
            self.report({"ERROR"}, tr("There is no such action in the blend"))
            return {"CANCELLED"}
        blend_settings.remove_clip(armature, self.index)
        return {"FINISHED"}


class SINEW_OT_blend_import_clip(_OfArmature, ImportHelper, bpy.types.Operator):
    bl_idname = "sinew.blend_import_clip"
    bl_label = "Add Clip from File"
    bl_description = (
        "Make actions of the animations in a BVH, glTF or FBX file whose bones have the same names and rest, "
        "and add them to the blend"
    )
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: bpy.props.StringProperty(
        default=";".join(f"*{ending}" for ending in clips.IMPORTERS), options={"HIDDEN"}
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = armature_of(context)
        try:
            made = clips.import_actions(armature, Path(self.filepath))
        except SinewError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for action in made:
            armature.sinew_blend.clips.add().action = action
        self.report({"INFO"}, tr("Added {names}", names=", ".join(action.name for action in made)))
        return {"FINISHED"}


class SINEW_OT_blend_actions(_OfArmature, stepped.Stepped, bpy.types.Operator):
    bl_idname = "sinew.blend_actions"
    bl_label = "Blend Actions"
    bl_description = (
        "Blend the actions into a new one of plain keys, which the armature plays; the actions themselves "
        "stay as they are"
    )
    bl_options = {"REGISTER", "UNDO"}
    saying = "Sinew blends actions"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        chosen = _chosen(armature_of(context))
        if len(chosen) < 2:
            cls.poll_message_set(tr("Add two actions or more in the panel Blend Actions"))
        return len(chosen) >= 2

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = armature_of(context)
        # By name: after undo, or loading another file, pointers would be invalid.
        self._armature = armature.name
        chosen, blend = _chosen(armature), armature.sinew_blend
        self._made = yield from blend_actions.make(
            armature,
            [clip.action for clip in chosen],
            blend.weights(chosen),
            blend.settings(),
        )

    def finish(self, context: bpy.types.Context) -> set[str]:
        made = self._made
        blend_actions.play(bpy.data.objects[self._armature], made.action)
        text = tr("Made {name}: {frames}", name=made.action.name, frames=_frames_text(made.frames))
        self.report({"INFO"}, text)
        for note in made.notes():
            self.report({"WARNING"}, note)
        context.view_layer.update()
        return {"FINISHED"}


def _chosen(armature: bpy.types.Object) -> list[blend_settings.SinewBlendClip]:
    """Returns the clips of its blend that have an action."""
    blend = blend_settings.of(armature)
    return [clip for clip in blend.clips if clip.action is not None] if blend is not None else []


def _frames_text(count: int) -> str:
    return counted(count, "{count} frame", "{count} frames")


class SINEW_PT_blend(Sidebar, bpy.types.Panel):
    bl_label = "Blend Actions"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return armature_of(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, armature = self.layout, armature_of(context)
        blend = blend_settings.of(armature)
        clips_of_blend = blend.clips if blend is not None else ()
        draw_armature(layout, context, armature)
        for index, clip in enumerate(clips_of_blend):
            column = layout.column(align=True)
            row = column.row(align=True)
            row.prop(clip, "action", text="")
            row.operator("sinew.blend_remove_clip", text="", icon="REMOVE").index = index
            row = column.row(align=True)
            if blend.changes:
                row.prop(clip, "weight_from", slider=True)
            row.prop(clip, "weight", slider=True)
        row = layout.row(align=True)
        row.operator("sinew.blend_add_clip", icon="ADD")
        row.operator("sinew.blend_import_clip", text="", icon="FILE_FOLDER")
        if not clips_of_blend:
            draw_text(layout, context, "Add actions of this armature, such as a walk and a run", icon="INFO")
            return
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        for name in ("method", "space", "changes"):
            column.prop(blend, name)
        if blend.changes:
            times = column.column(align=True)
            times.prop(blend, "change_start")
            times.prop(blend, "change_end")
            column.prop(blend, "smooth")
        column.prop(blend, "align")
        if blend.align:
            column.prop_search(blend, "align_bone", armature.data, "bones")
        column.prop(blend, "cycles")
        column.prop(blend, "root_motion")
        if blend.root_motion == TRAVEL or blend.align:
            column.prop_search(blend, "root", armature.data, "bones")
        draw_text(layout, context, METHODS[blend.method].description)
        layout.operator("sinew.blend_actions", icon="ACTION_TWEAK")


CLASSES = (
    SINEW_OT_blend_add_clip,
    SINEW_OT_blend_remove_clip,
    SINEW_OT_blend_import_clip,
    SINEW_OT_blend_actions,
    SINEW_PT_blend,
)
