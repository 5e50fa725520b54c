# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs the heat map and the diagnostics in the window of a real Blender, on human.blend.

    blender --factory-startup human.blend --python docs/photograph_heat.py -- sinew-0.1.0.zip heat-map.png diagnostics.png

Under an X server of its own; the photographs are of the whole screen, by xwd and netpbm.
"""  # noqa: E501

from __future__ import annotations

import json
import subprocess
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

import addon_utils
import bpy
import numpy as np

ZIP, HEAT_MAP, DIAGNOSTICS = (Path(argument).resolve() for argument in sys.argv[sys.argv.index("--") + 1 :])
FRAME = 16
# Planted: a patch of the chest without weights, one whose weights are next to nothing, one of five bones.
UNWEIGHTED, SMALL, MANY = (0.05, 0.0, 0.42), (-0.08, 0.0, 0.3), (0.06, 0.0, 0.15)


def in_view3d(region_type: str = "UI"):
    """The context of a click in a region of the 3D view; the sidebar's by default."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == region_type)
    return bpy.context.temp_override(window=window, area=area, region=region)


def install() -> None:
    addon_utils.enable("bl_pkg")
    bpy.ops.extensions.package_install_files(filepath=str(ZIP), repo="user_default", enable_on_install=True)


def open_panels(opened: set[str]) -> None:
    """Has these of Sinew's panels open, and the others closed, when they are first drawn."""
    names = [name for name in dir(bpy.types) if name.startswith("SINEW_PT_")]
    panels = [getattr(bpy.types, name) for name in names]
    panels.sort(key=lambda panel: hasattr(panel, "bl_parent_id"))
    for panel in reversed(panels):
        bpy.utils.unregister_class(panel)
    order = ["SINEW_PT_main", "SINEW_PT_measures", "SINEW_PT_numbers"]
    panels.sort(key=lambda panel: order.index(panel.__name__) if panel.__name__ in order else len(order))
    for panel in panels:
        panel.bl_options = set() if panel.__name__ in opened else {"DEFAULT_CLOSED"}
        bpy.utils.register_class(panel)


def choose_mesh() -> bpy.types.Object:
    obj = bpy.data.objects["Human"]
    with in_view3d():
        bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


def open_sidebar() -> None:
    with in_view3d():
        bpy.context.space_data.show_region_ui = True
        bpy.context.space_data.overlay.show_bones = False


def look_at(place: tuple[float, float, float], distance: float) -> None:
    """From the front; at once, where the operators take their time."""
    with in_view3d("WINDOW"):
        view = bpy.context.space_data.region_3d
        view.view_perspective = "ORTHO"
        view.view_rotation = (0.7071068, 0.7071068, 0.0, 0.0)
        view.view_location, view.view_distance = place, distance


def choose_tab() -> None:
    """Only once the sidebar was drawn: before, it has no tabs."""
    with in_view3d():
        bpy.context.region.active_panel_category = "Sinew"


def photograph(picture: Path) -> None:
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=3)
    subprocess.run(f"xwd -root -silent | xwdtopnm | pnmtopng > '{picture}'", shell=True, check=True)


def plant_faults(obj: bpy.types.Object) -> None:
    points = np.empty((len(obj.data.vertices), 3), dtype=np.float32)
    obj.data.vertices.foreach_get("co", points.ravel())
    world = np.array(obj.matrix_world)
    points = points @ world[:3, :3].T + world[:3, 3]

    def around(place: tuple[float, float, float], radius: float) -> list[int]:
        near = np.linalg.norm((points - place)[:, [0, 2]], axis=1) < radius
        return np.flatnonzero(near & (points[:, 1] < 0.0)).tolist()

    groups = list(obj.vertex_groups)
    for group in groups:
        group.remove(around(UNWEIGHTED, 0.04))
        group.remove(around(SMALL, 0.03))
    groups[0].add(around(SMALL, 0.03), 0.001, "REPLACE")
    for group in groups[:5]:
        group.add(around(MANY, 0.03), 0.2, "REPLACE")
    obj.vertex_groups.new(name="Spine_old").add(around(MANY, 0.02), 1.0, "REPLACE")


def steps() -> Iterator[None]:
    """One step a timer's tick, so that the window redraws and plays between them."""
    facts = {}
    install()
    scene, obj = bpy.context.scene, choose_mesh()
    open_panels({"SINEW_PT_measures", "SINEW_PT_numbers", "SINEW_PT_worst_frames"})
    with in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
    obj.sinew.method = "dq"
    scene.sinew_measures.quantity = "stretch"
    scene.sinew_measures.other = "lbs"
    scene.frame_set(FRAME)
    open_sidebar()
    look_at((0.12, 0.0, -0.06), 2.15)
    yield
    yield
    choose_tab()
    yield
    with in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
        facts["scan"] = sorted(bpy.ops.sinew.worst_frames("INVOKE_DEFAULT", over="SCENE"))
    for _second in range(60):
        yield
        if not any(operator.bl_idname == "SINEW_OT_worst_frames" for operator in running()):
            break
    facts["frame after the scan"] = scene.frame_current
    with in_view3d():
        bpy.ops.screen.animation_play()
    yield
    yield
    with in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    facts["played"] = scene.frame_current != FRAME
    scene.frame_set(FRAME)
    yield
    photograph(HEAT_MAP)
    with in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
        bpy.ops.sinew.remove("INVOKE_DEFAULT")
    scene.frame_set(1)
    plant_faults(obj)
    # Another window layout, whose sidebar was never drawn: which panels are open stays as it was otherwise.
    bpy.context.window_manager.windows[0].workspace = bpy.data.workspaces["Modeling"]
    open_panels({"SINEW_PT_diagnostics"})
    yield
    open_sidebar()
    look_at((0.06, 0.0, 0.28), 0.75)
    with in_view3d():
        bpy.ops.sinew.check("INVOKE_DEFAULT")
        bpy.ops.sinew.select_finding("INVOKE_DEFAULT", object="Human", finding="no_weights")
    yield
    yield
    choose_tab()
    yield
    yield
    photograph(DIAGNOSTICS)
    facts["mode"] = obj.mode
    print("FACTS " + json.dumps(facts), flush=True)
    print("PHOTOGRAPHED", flush=True)


def running() -> list[bpy.types.Operator]:
    return list(bpy.context.window_manager.windows[0].modal_operators)


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
