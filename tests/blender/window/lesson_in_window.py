# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of features_in_window.py: the lesson is opened while something is not saved, and once all is."""

from __future__ import annotations

from collections.abc import Generator

import bpy
import window

_ZIP, FOLDER = window.arguments()
VIEW = (500, 450)
facts: dict[str, object] = {}


def open_lesson() -> None:
    window.move(VIEW)
    with window.in_view3d("WINDOW"):
        try:
            bpy.ops.sinew.open_lesson("INVOKE_DEFAULT")
        except RuntimeError as error:
            facts["said"] = str(error)


def is_own() -> bool:
    return "Unsaved" in bpy.data.objects and "Lesson" not in bpy.data.texts


def steps() -> Generator[None, None, dict]:
    bpy.data.objects.new("Unsaved", None)
    bpy.ops.ed.undo_push(message="work")
    facts["is dirty"] = bpy.data.is_dirty
    # Blender asks; Esc keeps the open file.
    open_lesson()
    yield from window.wait()
    facts["asks first"] = is_own()
    window.press("ESC", VIEW)
    yield from window.wait()
    facts["kept after Esc"] = is_own()
    # Nothing is lost either if the user has switched that question off.
    bpy.context.preferences.view.use_save_prompt = False
    open_lesson()
    yield from window.wait()
    facts["kept without the question"] = is_own()
    bpy.context.preferences.view.use_save_prompt = True
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "own.blend"))
    yield from window.wait()
    open_lesson()
    yield from window.wait()
    facts["opened"] = ["Lesson" in bpy.data.texts, bpy.data.filepath, hasattr(bpy.types.Object, "sinew")]
    facts["reading"] = [area.type for area in bpy.context.window_manager.windows[0].screen.areas]
    return facts
