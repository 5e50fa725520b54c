# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs Sinew's zip in a Blender with a window, works its panel on human.blend and photographs it.

    blender --factory-startup human.blend --python docs/photograph_panel.py -- sinew-0.1.0.zip panel.png

Under an X server of its own; the photograph is of the whole screen, by xwd and netpbm.
"""

from __future__ import annotations

import json
import subprocess
import sys
import traceback
from pathlib import Path

import addon_utils
import bpy
import numpy as np

ZIP, PICTURE = (Path(argument).resolve() for argument in sys.argv[sys.argv.index("--") + 1 :])
FRAME = 16


def final_points(obj: bpy.types.Object) -> np.ndarray:
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    return points


def in_view3d(region_type: str = "UI"):
    """The context of a click in a region of the 3D view; the sidebar's by default."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == region_type)
    return bpy.context.temp_override(window=window, area=area, region=region)


def set_up() -> dict[str, object]:
    """Everything up to the moment of the photograph; what the panel's buttons did, as facts."""
    addon_utils.enable("bl_pkg")
    bpy.ops.extensions.package_install_files(filepath=str(ZIP), repo="user_default", enable_on_install=True)
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    modifier = next(m for m in obj.modifiers if m.type == "ARMATURE")
    modifier.use_deform_preserve_volume = True
    scene.frame_set(FRAME)
    expected = final_points(obj)
    with in_view3d():
        bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    with in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.rebind("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.remove("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
    started_as = obj.sinew.method
    scene.frame_set(FRAME)
    worst = float(np.abs(final_points(obj) - expected).max())
    return {
        "method": started_as,
        "worst": worst,
        "diagonal": float(np.linalg.norm(np.ptp(expected, axis=0))),
        "error": obj.sinew.error,
    }


def open_sidebar() -> None:
    with in_view3d():
        bpy.context.space_data.show_region_ui = True
        bpy.context.space_data.overlay.show_bones = False
    with in_view3d("WINDOW"):
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()


def choose_tab() -> None:
    """Only once the sidebar was drawn: before, it has no tabs."""
    with in_view3d():
        bpy.context.region.active_panel_category = "Sinew"


def photograph() -> None:
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=3)
    subprocess.run(f"xwd -root -silent | xwdtopnm | pnmtopng > '{PICTURE}'", shell=True, check=True)
    print("PHOTOGRAPHED", flush=True)


def steps():
    """One step a timer's tick, so that the window redraws and plays between them."""
    facts = set_up()
    open_sidebar()
    yield
    yield
    choose_tab()
    with in_view3d():
        bpy.ops.screen.animation_play()
    for _second in range(3):
        yield
    facts["played"] = bpy.context.scene.frame_current != FRAME
    with in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    bpy.context.scene.frame_set(FRAME)
    yield
    print("FACTS " + json.dumps(facts), flush=True)
    photograph()


PROGRAM = steps()


def tick() -> float | None:
    try:
        next(PROGRAM)
    except StopIteration:
        bpy.ops.wm.quit_blender()
        return None
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        bpy.ops.wm.quit_blender()
        return None
    return 1.0


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=2.0)
