# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of a method with its parameters and stages, by Blender's own mechanism: each is a Python file in
the user's folder of presets."""

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..attach.feature import Feature
from ..attach.properties import SETTING_GROUPS, SHARED
from ..deform import session
from .operators import OnSinewObjects

FOLDER = "sinew/methods"
DEFINES = ("character = bpy.context.scene.sinew_character",)
# Without vertex groups, as their names belong to a mesh, not to a method.
PATHS = (
    *(f"character.{name}" for name in SHARED),
    *(
        f"character.{group}.{name}"
        for group, cls in SETTING_GROUPS.items()
        for name in cls.__annotations__
        if name != "group"
    ),
)


class SINEW_OT_method_preset_add(AddPresetBase, OnSinewObjects, bpy.types.Operator):
    bl_label = "Add Method Preset"
    bl_description = "Keep the method, its parameters and the stages under a name, or remove that preset"
    bl_options = {"REGISTER"}

    preset_menu = "SINEW_PT_method_presets"
    preset_defines = DEFINES
    preset_values = PATHS
    preset_subdir = FOLDER


class SINEW_OT_method_preset(OnSinewObjects, bpy.types.Operator):
    bl_label = "Use Method Preset"
    bl_description = "Set the character to this method, with its parameters and stages"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    filepath: bpy.props.StringProperty(
        name="File", description="The preset", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    menu_idname: bpy.props.StringProperty(
        name="Menu",
        description="The one that shows its name",
        default="SINEW_PT_method_presets",
        options={"SKIP_SAVE"},
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        # All at once: one evaluation, and one undo step.
        with session.changing(context):
            return bpy.ops.script.execute_preset(filepath=self.filepath, menu_idname=self.menu_idname)


class SINEW_PT_method_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Method Presets"
    preset_subdir = FOLDER
    preset_operator = SINEW_OT_method_preset.bl_idname
    preset_add_operator = SINEW_OT_method_preset_add.bl_idname


FEATURE = Feature((SINEW_OT_method_preset_add, SINEW_OT_method_preset, SINEW_PT_method_presets))
