# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs the heat map and the diagnostics in the window of a real Blender, on human.blend.

blender --factory-startup human.blend --python tools/pictures/photograph_heat.py -- sinew-VERSION.zip heat-map.png diagnostics.png
"""  # noqa: E501

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, HEAT_MAP, DIAGNOSTICS = window.arguments()
FRAME = 16
# Panels in this order, then the others.
ORDER = ("SINEW_PT_main", "SINEW_PT_measures", "SINEW_PT_numbers")
# Planted: a patch of the chest without weights, one whose weights are next to nothing, one of five bones.
UNWEIGHTED, SMALL, MANY = (0.05, 0.0, 0.42), (-0.08, 0.0, 0.3), (0.06, 0.0, 0.15)


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
    window.install(ZIP)
    scene, obj = bpy.context.scene, bpy.data.objects["Human"]
    window.select_only(obj)
    window.open_panels("SINEW_PT_measures", "SINEW_PT_numbers", "SINEW_PT_worst_frames", first=ORDER)
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
    obj.sinew.method = "dq"
    scene.sinew_measures.quantity = "stretch"
    scene.sinew_measures.other = "lbs"
    scene.frame_set(FRAME)
    window.open_sidebar()
    window.look_from_front((0.12, 0.0, -0.06), 2.15)
    yield
    yield
    window.choose_tab()
    yield
    with window.in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
        facts["scan"] = sorted(bpy.ops.sinew.worst_frames("INVOKE_DEFAULT", over="SCENE"))
    for _second in range(60):
        yield
        if not any(operator.bl_idname == "SINEW_OT_worst_frames" for operator in running()):
            break
    facts["frame after the scan"] = scene.frame_current
    with window.in_view3d():
        bpy.ops.screen.animation_play()
    yield
    yield
    with window.in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    facts["played"] = scene.frame_current != FRAME
    scene.frame_set(FRAME)
    yield
    window.photograph(HEAT_MAP)
    with window.in_view3d():
        bpy.ops.sinew.heat_map("INVOKE_DEFAULT")
        bpy.ops.sinew.remove("INVOKE_DEFAULT")
    scene.frame_set(1)
    plant_faults(obj)
    # Another window layout, whose sidebar was never drawn: which panels are open stays as it was otherwise.
    bpy.context.window_manager.windows[0].workspace = bpy.data.workspaces["Modeling"]
    window.open_panels("SINEW_PT_diagnostics", first=ORDER)
    yield
    window.open_sidebar()
    window.look_from_front((0.06, 0.0, 0.28), 0.75)
    with window.in_view3d():
        bpy.ops.sinew.check("INVOKE_DEFAULT")
        bpy.ops.sinew.select_finding("INVOKE_DEFAULT", object="Human", finding="no_weights")
    yield
    yield
    window.choose_tab()
    yield
    yield
    window.photograph(DIAGNOSTICS)
    facts["mode"] = obj.mode
    print("FACTS " + json.dumps(facts), flush=True)


def running() -> list[bpy.types.Operator]:
    return list(bpy.context.window_manager.windows[0].modal_operators)


window.run(steps())
