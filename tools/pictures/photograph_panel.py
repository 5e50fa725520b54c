# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs Sinew's zip in a Blender with a window, works its panel on human.blend and photographs it.

blender --factory-startup human.blend --python photograph_panel.py -- sinew.zip panel.png [de_DE]

The language of Blender's interface may be given; without it, it is English.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, PICTURE, *LANGUAGE = window.arguments()
FRAME = 16


def set_up() -> dict[str, object]:
    """Everything up to the moment of the photograph; what the panel's buttons did, as facts."""
    window.install(ZIP)
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    modifier = next(m for m in obj.modifiers if m.type == "ARMATURE")
    modifier.use_deform_preserve_volume = True
    scene.frame_set(FRAME)
    expected = window.final_points(obj)
    window.select_only(obj)
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.rebind("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.remove("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
    started_as = obj.sinew.method
    scene.frame_set(FRAME)
    worst = float(np.abs(window.final_points(obj) - expected).max())
    return {
        "method": started_as,
        "worst": worst,
        "diagonal": float(np.linalg.norm(np.ptp(expected, axis=0))),
        "error": obj.sinew.error,
    }


def speak(language: str) -> None:
    view = bpy.context.preferences.view
    view.language = language
    view.use_translate_interface = view.use_translate_tooltips = view.use_translate_reports = True


def steps():
    if LANGUAGE:
        speak(LANGUAGE[0].name)
    facts = set_up()
    window.open_sidebar()
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
    yield
    yield
    window.choose_tab()
    with window.in_view3d():
        bpy.ops.screen.animation_play()
    for _second in range(3):
        yield
    facts["played"] = bpy.context.scene.frame_current != FRAME
    with window.in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    bpy.context.scene.frame_set(FRAME)
    yield
    window.photograph(PICTURE)
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps())
