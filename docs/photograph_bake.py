# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs the panel Bake Error in the window of a real Blender: human.blend baked to bones, with the errors
before on the left and those after on the right.

    blender --factory-startup human.blend --python docs/photograph_bake.py -- sinew.zip bake-error.webp
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
# Columns and rows of the window's picture: the figure, and the same with the sidebar. Rows are from the top.
FIGURE, WITH_SIDEBAR, ROWS = (120, 640), (120, 1278), (52, 782)


def pixels_of(picture: Path) -> np.ndarray:
    """float32 [height, width, 4], the highest row first."""
    image = bpy.data.images.load(str(picture))
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1]


def save(pixels: np.ndarray) -> None:
    height, width, _channels = pixels.shape
    image = bpy.data.images.new("Both", width, height)
    image.pixels.foreach_set(np.ascontiguousarray(pixels[::-1]).ravel())
    image.file_format = "WEBP"
    image.save(filepath=str(PICTURE), quality=80)


def steps() -> Iterator[None]:
    window.install(ZIP)
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    window.select_only(obj)
    window.open_panels("SINEW_PT_bake_error", first=("SINEW_PT_main", "SINEW_PT_bake_error"))
    shading = next(area for area in bpy.context.screen.areas if area.type == "VIEW_3D").spaces[0].shading
    before = shading.color_type
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
        obj.sinew.method = "dq"
        options = {"frames": FRAMES, "step": 4, "helpers": HELPERS}
        assert bpy.ops.sinew.bake("EXEC_DEFAULT", kind="bones", **options) == {"FINISHED"}
        bpy.context.space_data.overlay.show_cursor = False
    scene.frame_set(FRAME)
    window.open_sidebar()
    with window.in_view3d("WINDOW"):
        view = bpy.context.space_data.region_3d
        view.view_perspective = "ORTHO"
        view.view_rotation = (0.7071068, 0.7071068, 0.0, 0.0)
        view.view_location, view.view_distance = (0.35, 0.0, 0.0), 2.6
    yield
    yield
    window.choose_tab()
    yield
    pictures = []
    shown = []
    for choice in ("BEFORE", "AFTER"):
        with window.in_view3d():
            bpy.ops.sinew.bake_error("INVOKE_DEFAULT", errors=choice)
        yield
        pictures.append(PICTURE.with_name(f"{choice}.png"))
        window.photograph(pictures[-1])
        shown.append(shading.color_type)
    columns = zip(pictures, (FIGURE, WITH_SIDEBAR), strict=True)
    rows = slice(*ROWS)
    save(np.hstack([pixels_of(picture)[rows, slice(*own)] for picture, own in columns]))
    with window.in_view3d():
        bpy.ops.sinew.bake_error("INVOKE_DEFAULT", errors="OFF")
    facts = {"color types": [before, *shown, shading.color_type]}
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps())
