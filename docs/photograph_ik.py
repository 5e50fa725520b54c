# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs the panel Inverse Kinematics in the window of a real Blender, on human.blend with both hands at
a ball, solved live by Sinew. The ball is moved, which Ctrl+Z undoes; a frame is rendered by the window's own
button; the file is saved and opened again. It takes --enable-event-simulate.

    blender --factory-startup OPTION human.blend --python docs/photograph_ik.py -- sinew.zip panel.png render.png
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

ZIP, PICTURE, RENDER = window.arguments()
TICK = 0.1
FRAME = 16
BALL = (0.02, -0.42, 0.34)


def hold_a_ball() -> None:
    rig = bpy.data.objects["Rig"]
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.09, location=BALL)
    ball = bpy.context.object
    ball.name = "Ball"
    bpy.ops.object.shade_smooth()
    for side, x in (("l", 1.0), ("r", -1.0)):
        target = bpy.data.objects.new(f"Grip.{side}", None)
        pole = bpy.data.objects.new(f"Elbow.{side}", None)
        for each, place in ((target, (0.1 * x, 0.0, 0.0)), (pole, (0.9 * x, 0.1, 0.2))):
            bpy.context.scene.collection.objects.link(each)
            each.empty_display_size = 0.03
            each.location = place
        target.parent = ball
        constraint = rig.pose.bones[f"lowerarm_{side}"].constraints.new("IK")
        constraint.target, constraint.pole_target = target, pole
        constraint.chain_count = 2
    window.select_only(rig)


def reach() -> float:
    """The largest distance of a wrist to its grip, as the window shows it."""
    graph = bpy.context.evaluated_depsgraph_get()
    rig = bpy.data.objects["Rig"].evaluated_get(graph)
    found = []
    for side in "lr":
        wrist = rig.matrix_world @ rig.pose.bones[f"lowerarm_{side}"].tail
        grip = bpy.data.objects[f"Grip.{side}"].evaluated_get(graph).matrix_world.translation
        found.append((wrist - grip).length)
    return float(max(found))


def steps() -> Iterator[None]:
    facts: dict[str, object] = {}
    window.install(ZIP)
    scene = bpy.context.scene
    scene.frame_set(FRAME)
    hold_a_ball()
    window.open_panels("SINEW_PT_ik")
    facts["blender"] = reach()
    window.open_sidebar()
    yield
    yield
    window.choose_tab()
    with window.in_view3d():
        assert bpy.ops.sinew.add("INVOKE_DEFAULT") == {"FINISHED"}
        assert bpy.ops.sinew.live_ik("INVOKE_DEFAULT") == {"FINISHED"}
    with window.in_view3d("WINDOW"):
        view = bpy.context.space_data.region_3d
        view.view_location, view.view_distance = (0.15, 0.0, 0.3), 2.2
    for _tick in range(10):
        yield
    facts["live"] = reach()
    window.photograph(PICTURE)
    yield
    with window.in_view3d():
        bpy.ops.screen.animation_play()
    frames = []
    for _tick in range(15):
        yield
        frames.append((scene.frame_current, reach()))
    with window.in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    facts["played"] = max(distance for _frame, distance in frames)
    facts["frames"] = len({frame for frame, _distance in frames})
    scene.frame_set(FRAME)
    bpy.ops.ed.undo_push(message="Before")
    window.select_only(bpy.data.objects["Ball"])
    with window.in_view3d("WINDOW"):
        bpy.ops.transform.translate("EXEC_DEFAULT", True, value=(0.0, -0.02, 0.1))
    yield
    facts["moved"] = reach()
    middle = bpy.context.window_manager.windows[0]
    window.press("Z", (middle.width // 3, middle.height // 2), ctrl=True)
    yield from window.until(lambda: abs(bpy.data.objects["Ball"].location.z - BALL[2]) < 1e-4, "undo")
    yield
    facts["undone"] = reach()
    yield from render(facts)
    saved = RENDER.with_suffix(".blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(saved))
    yield
    facts["saved"] = reach()
    bpy.ops.wm.open_mainfile(filepath=str(saved), load_ui=False)
    yield
    yield
    facts["opened"] = reach()
    facts["muted"] = bpy.data.objects["Rig"].pose.bones["lowerarm_l"].constraints["IK"].mute
    print("FACTS " + json.dumps(facts), flush=True)


def render(facts: dict[str, object]) -> Iterator[None]:
    """By the window's own render, in a thread beside it, while the window goes on drawing."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0.7, -2.2, 0.75), (np.radians(82.0), 0.0, np.radians(17.0))
    scene.camera = camera
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.shading.light = "STUDIO"
    scene.render.resolution_x, scene.render.resolution_y = 480, 480
    scene.render.resolution_percentage = 100
    bpy.context.window_manager.windows[0].cursor_warp(10, 10)
    ended = []
    bpy.app.handlers.render_complete.append(lambda *_args: ended.append(True))
    with window.in_view3d():
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from window.until(lambda: bool(ended) and not bpy.app.is_job_running("RENDER"), "the render")
    bpy.data.images["Render Result"].save_render(str(RENDER))
    yield
    facts["rendered"] = reach()


window.run(steps(), TICK)
