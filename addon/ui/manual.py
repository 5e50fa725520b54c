# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Blender's "Online Manual", on Sinew's buttons and properties, open the page in the extension."""

from pathlib import Path

import bpy

from ..attach import properties
from ..attach.feature import Feature

PAGE = Path(__file__).resolve().parent.parent / "manual.html"
# By the start of the name, in lower case as Blender looks it up; the first match counts.
_SECTIONS = {
    "bpy.ops.sinew.method_preset*": "presets",
    "bpy.ops.sinew.use_method*": "method",
    "bpy.ops.sinew.own_settings*": "meshes",
    "bpy.ops.sinew.make_group*": "stages",
    "bpy.ops.sinew.auto_mix*": "stages",
    "bpy.ops.sinew.take_over_smooth*": "stages",
    "bpy.ops.sinew.suggest*": "suggest",
    "bpy.ops.sinew.bake_inbetweens*": "in-betweens",
    "bpy.ops.sinew.blend*": "blend-actions",
    "bpy.ops.sinew.bake_ik*": "inverse-kinematics",
    "bpy.ops.sinew.original_action*": "inverse-kinematics",
    "bpy.ops.sinew.bake*": "bake",
    "bpy.ops.sinew.corrective_key*": "bake",
    "bpy.ops.sinew.export*": "bake",
    "bpy.ops.sinew.compare*": "compare",
    "bpy.ops.sinew.*comparison*": "compare",
    "bpy.ops.sinew.*heat*": "heat-map",
    "bpy.ops.sinew.worst_frames*": "heat-map",
    "bpy.ops.sinew.go_to_frame*": "heat-map",
    "bpy.ops.sinew.flex*": "flex",
    "bpy.ops.sinew.save_flex*": "flex",
    "bpy.ops.sinew.check*": "diagnostics",
    "bpy.ops.sinew.*finding*": "diagnostics",
    "bpy.ops.sinew.mend*": "diagnostics",
    "bpy.ops.sinew.*precomput*": "method",
    "bpy.ops.sinew.*": "character",
    "bpy.types.sinewblend*": "blend-actions",
    "bpy.types.scene.sinew_most_influences*": "diagnostics",
    "bpy.types.sinewmeasures*": "heat-map",
    "bpy.types.sinewcomparison*": "compare",
    "bpy.types.sinewgltf*": "bake",
    "bpy.types.sinewpreferences*": "preferences",
    "bpy.types.sinew*.scale_rule*": "stages",
    "bpy.types.sinew*.normals*": "stages",
    "bpy.types.sinew*.leave_small*": "stages",
    "bpy.types.sinew*.is_own*": "meshes",
    "bpy.types.sinew*.row*": "meshes",
    "bpy.types.sinewsettings.enabled*": "character",
    "bpy.types.sinewcharacter.enabled*": "character",
    "bpy.types.sinewsettings.method*": "method",
    "bpy.types.sinewcharacter.method*": "method",
    "bpy.types.sinewmethod*": "method",
    "bpy.types.sinewstage*": "stages",
    # A character has a group for each method with parameters, and for each stage.
    **{f"bpy.types.sinewcharacter{name.replace('_', '')}.*": "method" for name in properties.METHOD_GROUPS},
    "bpy.types.sinewcharacter*.*": "stages",
    "bpy.types.sinewreplaced*": "meshes",
    "bpy.types.sinew*": "character",
}


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """For bpy.utils.register_manual_map(): the start of addresses, and patterns with the end of each."""
    return PAGE.as_uri(), tuple((pattern, f"#{section}") for pattern, section in _SECTIONS.items())


FEATURE = Feature(
    begin=lambda: bpy.utils.register_manual_map(manual_map),
    end=lambda: bpy.utils.unregister_manual_map(manual_map),
)
