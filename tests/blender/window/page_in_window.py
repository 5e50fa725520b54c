# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: saves a comparison as a page with the file browser. Esc stops the frames."""

from __future__ import annotations

from collections.abc import Generator

import bpy
import five_meshes
import window

_ZIP, FOLDER = window.arguments()
# Long enough to be stopped.
LONG = 20_000
# In a picture of a window of 1280 x 800.
SAVE = (1207, 757)


def main_window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def is_saving() -> bool:
    return any(each.bl_idname == "SINEW_OT_save_comparison" for each in main_window().modal_operators)


def is_browsing() -> bool:
    return any(area.type == "FILE_BROWSER" for area in main_window().screen.areas)


def save(name: str) -> Generator[None, None, None]:
    with window.in_view3d("WINDOW"):
        bpy.ops.sinew.save_comparison("INVOKE_DEFAULT", filepath=str(FOLDER / name))
    yield from window.until(is_browsing, "the file browser")
    yield from window.wait()
    yield from window.click(SAVE)
    yield from window.until(lambda: not is_browsing(), "the end of the file browser")


def steps() -> Generator[None, None, dict]:
    # In the main window, so that the button has one place.
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    five_meshes.make(vertices=2000)
    scene = bpy.context.scene
    with window.in_view3d():
        bpy.ops.sinew.compare(methods={"lbs", "cor"})
    yield from window.wait()
    scene.frame_set(3)
    scene.frame_start, scene.frame_end = 1, LONG
    yield from save("stopped")
    yield from window.until(is_saving, "the frames of the page")
    yield
    window.press("ESC", (main_window().width // 2, main_window().height // 2))
    yield from window.until(lambda: not is_saving(), "the end")
    facts = {"stopped": [(FOLDER / "stopped.html").exists(), scene.frame_current]}
    scene.frame_end = 5
    yield from save("saved")
    page = FOLDER / "saved.html"
    yield from window.until(lambda: page.exists() and not is_saving(), "the page")
    text = page.read_text(encoding="utf-8")
    facts["saved"] = ['"frames": [1, 2, 3, 4, 5]' in text, '"methods": {"lbs"' in text, scene.frame_current]
    return facts
