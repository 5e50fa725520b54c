# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs the heat map of the error of a bake in the window of a real Blender: human.blend baked to
bones, with the errors before on the left and those after on the right.

    blender --factory-startup human.blend --python photograph_bake.py -- sinew.zip bake-error.webp
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, PICTURE = window.arguments()
FRAMES, FRAME, HELPERS = "2-46", 16, 40


def view_in(picture: Path) -> np.ndarray:
    """The 3D view without its header and the tools, as window.pixels_of()."""
    with window.in_view3d("WINDOW"):
        region, others = bpy.context.region, bpy.context.area.regions
        left = next(each.width for each in others if each.type == "TOOLS")
        # The tool settings are above it.
        top = region.y + region.height - 50
        rows, columns = slice(region.y, top), slice(region.x + left, region.x + region.width)
    return window.pixels_of(picture)[rows, columns]


def steps() -> Iterator[None]:
    window.install(ZIP)
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    window.select_only(obj)
    window.open_panels("SINEW_PT_measures", first=("SINEW_PT_main", "SINEW_PT_measures"))
    shading = window.area_of("VIEW_3D").spaces[0].shading
    before = shading.color_type
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
        obj.sinew.method = "dq"
        options = {"frames": FRAMES, "step": 4, "helpers": HELPERS}
        assert bpy.ops.sinew.bake("EXEC_DEFAULT", kind="bones", **options) == {"FINISHED"}
        overlay = bpy.context.space_data.overlay
        overlay.show_cursor = overlay.show_outline_selected = overlay.show_object_origins = False
        overlay.show_axis_x = overlay.show_text = False
    scene.frame_set(FRAME)
    window.open_sidebar()
    window.look_from_front((0.52, 0.0, -0.02), 2.2)
    yield
    yield
    window.choose_tab()
    yield
    pictures = []
    shown = []
    for choice in ("bake_error_before", "bake_error"):
        with window.in_view3d():
            bpy.ops.sinew.heat_map("INVOKE_DEFAULT", quantity=choice)
        yield
        pictures.append(PICTURE.with_name(f"{choice}.png"))
        window.photograph(pictures[-1])
        shown.append(shading.color_type)
    left, right = (view_in(picture) for picture in pictures)
    window.save_webp(np.hstack([left[:, : left.shape[1] // 2], right]), PICTURE)
    with window.in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
    facts = {"color types": [before, *shown, shading.color_type]}
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps())
