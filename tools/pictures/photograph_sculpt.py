# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs sculpt mode under dq in the window of a real Blender, on human.blend: the shape is the same as
before, and the panel says why.

    blender --factory-startup human.blend --python tools/pictures/photograph_sculpt.py -- sinew.zip sculpt.png
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
FRAME = 32


def set_mode(mode: str) -> None:
    with window.in_view3d("WINDOW"):
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=mode)


def steps() -> Iterator[None]:
    window.install(ZIP)
    obj = bpy.data.objects["Human"]
    modifier = next(each for each in obj.modifiers if each.type == "ARMATURE")
    bpy.context.scene.frame_set(FRAME)
    window.select_only(obj)
    linear = window.final_points(obj)
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
    obj.sinew.method = "dq"
    window.open_sidebar()
    window.look_from_front((0.35, 0.0, 0.0), 2.6)
    yield
    yield
    window.choose_tab()
    before = window.final_points(obj)
    set_mode("SCULPT")
    for _second in range(3):
        yield
    facts = {
        "diagonal": float(np.linalg.norm(np.ptp(before, axis=0))),
        "linear": float(np.abs(linear - before).max()),
        "worst": float(np.abs(window.final_points(obj) - before).max()),
        "volume": [modifier.use_deform_preserve_volume],
    }
    window.photograph(PICTURE)
    set_mode("OBJECT")
    yield
    facts["volume"].append(modifier.use_deform_preserve_volume)
    facts["worst after"] = float(np.abs(window.final_points(obj) - before).max())
    print("FACTS " + json.dumps(facts), flush=True)


window.run(steps())
