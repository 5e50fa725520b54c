# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Blender's "Online Manual", on Sinew's buttons and properties, open the page in the extension."""

from pathlib import Path

import bpy

from ..attach import properties
from ..attach.feature import Feature

PAGE = Path(__file__).resolve().parent.parent / "manual.html"
# Sections with the starts of names, in lower case as Blender looks them up; the first match counts.
_OPERATORS = (
    ("presets", "method_preset"),
    ("contact-sheet", "contact_sheet"),
    ("variants", "*variant"),
    ("method", "use_method", "*precomput"),
    ("meshes", "own_settings"),
    ("stages", "make_group", "auto_mix", "take_over_smooth"),
    ("suggest", "suggest"),
    ("in-betweens", "bake_inbetweens", "original_action"),
    ("blend-actions", "blend"),
    ("bake", "bake", "use_before", "corrective_key", "export"),
    ("compare", "compare", "*comparison"),
    ("heat-map", "*heat", "worst_frames", "go_to_frame"),
    ("range-of-motion", "*motion_range"),
    ("flex", "flex", "save_flex"),
    ("diagnostics", "check", "*finding", "mend"),
    ("character", ""),
)
# A character has a group for each method with parameters, and for each stage.
_GROUPS_OF_METHODS = (f"sinewcharacter{name.replace('_', '')}." for name in properties.METHOD_GROUPS)
_TYPES = (
    ("blend-actions", "sinewblend"),
    ("diagnostics", "scene.sinew_most_influences"),
    ("heat-map", "sinewmeasures"),
    ("compare", "sinewcomparison"),
    ("range-of-motion", "sinewmotionrange"),
    ("bake", "sinewgltf"),
    ("preferences", "sinewpreferences"),
    ("stages", "sinew*.scale_rule", "sinew*.normals", "sinew*.leave_small", "sinewstage"),
    ("meshes", "sinew*.is_own", "sinew*.row", "sinewreplaced"),
    ("character", "sinewcharacter.enabled"),
    ("method", "sinewsettings.method", "sinewcharacter.method", "sinewmethod", *_GROUPS_OF_METHODS),
    ("stages", "sinewcharacter*."),
    ("character", "sinew"),
)


def manual_map() -> tuple[str, list[tuple[str, str]]]:
    """For bpy.utils.register_manual_map(): the start of addresses, and patterns with the end of each."""
    tables = ("bpy.ops.sinew.", _OPERATORS), ("bpy.types.", _TYPES)
    return PAGE.as_uri(), [
        (f"{kind}{start}*", f"#{section}")
        for kind, table in tables
        for section, *starts in table
        for start in starts
    ]


FEATURE = Feature(
    begin=lambda: bpy.utils.register_manual_map(manual_map),
    end=lambda: bpy.utils.unregister_manual_map(manual_map),
)
