# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps back and forth, and in several windows, scenes and views."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import window
from window_hand import SECOND, Run, Steps, choose, click, hero, playing, press, push, rig, step, wait
from window_scene import pose


def method(name: str) -> Callable[[], None]:
    def change() -> None:
        hero().sinew.method = name
        push(f"Method {name}")

    return change


def turn_off() -> None:
    hero().sinew.enabled = False
    push("Off")


def turn_on() -> None:
    hero().sinew.enabled = True
    push("On")


def bend() -> None:
    pose(rig(), 35.0)
    push("Bent")


def reweigh() -> None:
    hero().vertex_groups["bone.1"].add(list(range(4000, 8000)), 0.3, "REPLACE")
    push("Weights")


def shift() -> None:
    for vertex in hero().data.vertices[:5000]:
        vertex.co.z += 0.1
    hero().data.update_tag()
    push("Vertices")


@step("undo")
def undo_and_redo_by_keys(run: Run) -> Steps:
    """Ten steps of all kinds, then ctrl+Z to the first state and ctrl+shift+Z to the last."""
    actions = [
        (method("lbs"), "lbs"),
        (bend, "lbs"),
        (method("dq"), "dq"),
        (turn_off, ""),
        (turn_on, "dq"),
        (reweigh, "dq"),
        (shift, "dq"),
        (lambda: click("sinew.remove", "Hero"), ""),
        (lambda: click("sinew.add", "Hero"), "lbs"),
        (method("dq"), "dq"),
    ]
    history = ["dq"]
    for action, wanted in actions:
        action()
        history.append(wanted)
        run.wanted["Hero"] = wanted
        yield from run.see(f"done {len(history) - 1}")
    for at in reversed(range(len(actions))):
        press("Z", ctrl=True)
        run.wanted["Hero"] = history[at]
        yield from run.see(f"undone to {at}", 4)
    for at in range(1, len(history)):
        press("Z", ctrl=True, shift=True)
        run.wanted["Hero"] = history[at]
        yield from run.see(f"redone to {at}", 4)
    yield from run.check_frames()


@step("undo")
def save_after_undo(run: Run) -> Steps:
    yield from run.undo("undone", "lbs")
    run.save("undone.blend")
    press("Z", ctrl=True, shift=True)
    run.wanted["Hero"] = "dq"
    yield from run.see("redone over a saved file", 4)
    press("Z", ctrl=True)
    yield from wait(4)
    run.wanted["Hero"] = "lbs"
    yield from run.check_frames()


@step("undo")
def undo_while_it_plays(run: Run) -> Steps:
    run.wanted["Hero"] = "dq"
    hero().sinew.method = "dq"
    push("dq")
    hero().location.y += 0.3
    push("Moved")
    with playing():
        yield from wait(10)
        press("Z", ctrl=True)
        yield from wait(10)
    yield from run.see("undone while it played")
    yield from run.check_frames()


@step("undo")
def scene_that_redo_brings_back(run: Run) -> Steps:
    """Blender sends no notification of its first evaluation: Sinew looks four times a second."""
    click("scene.new", type="LINK_COPY")
    yield from run.see("in a copy of the scene")
    yield from run.undo("undone")
    press("Z", ctrl=True, shift=True)
    yield from run.see("redone", 20)
    press("Z", ctrl=True)
    yield from wait(4)


@step("windows")
def two_windows_and_scenes(run: Run) -> Steps:
    with window.in_view3d("WINDOW"):
        bpy.ops.wm.window_new_main()
    yield from wait(4)
    first, second = bpy.context.window_manager.windows
    second.scene = bpy.data.scenes[SECOND]
    yield from run.see("with two windows", 4)
    guest = bpy.data.objects["Guest"]
    area = next(area for area in second.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=second, area=area, region=region):
        second.view_layer.objects.active = guest
        guest.select_set(True)
        bpy.ops.sinew.add("INVOKE_DEFAULT")
    guest.sinew.method = "dq"
    run.wanted["Guest"] = "dq"
    yield from run.see("Guest on, too", 4)
    for frame in (5, 20):
        first.scene.frame_set(frame)
        second.scene.frame_set(21 - frame)
        yield from run.see(f"at frame {frame} and {21 - frame}", 4)
    pose(rig("Guest"), 60.0)
    pose(rig(), 20.0)
    yield from run.see("both posed", 4)


@step("windows")
def same_scene_in_two_windows(run: Run) -> Steps:
    first, second = bpy.context.window_manager.windows
    second.scene = first.scene
    yield from run.see("the same scene", 4)
    layer = first.scene.view_layers.new("Other layer")
    second.view_layer = layer
    yield from run.see("another view layer", 4)
    first.scene.frame_set(7)
    yield from run.see("another view layer, at frame 7", 4)
    run.save("windows.blend")
    with bpy.context.temp_override(window=second):
        bpy.ops.wm.window_close()
    yield from wait(4)
    first.scene.view_layers.remove(layer)
    yield from wait(4)
    yield from run.check_frames()


@step("windows")
def views(run: Run) -> Steps:
    """Quad view, split, local view, rendered shading."""
    main = bpy.context.window_manager.windows[0]
    choose("Hero")
    for name, arguments in (
        ("screen.region_quadview", {}),
        ("screen.area_split", {"direction": "VERTICAL", "factor": 0.5}),
        ("view3d.localview", {"frame_selected": False}),
    ):
        with window.in_view3d("WINDOW"):
            category, _dot, operator = name.partition(".")
            getattr(getattr(bpy.ops, category), operator)("EXEC_DEFAULT", **arguments)
        yield from run.see(f"after {name}", 4)
        yield from run.check_frames()
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.localview("EXEC_DEFAULT", frame_selected=False)
    with window.in_view3d("WINDOW"):
        bpy.ops.screen.region_quadview("EXEC_DEFAULT")
    for area in main.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces[0].shading.type = "RENDERED"
    yield from wait(4)
    yield from run.check_frames()
    for area in main.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces[0].shading.type = "SOLID"
