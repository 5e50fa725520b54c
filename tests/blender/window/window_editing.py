# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that pose, paint and edit, and that change the modifier stack."""

from __future__ import annotations

import bpy
import numpy as np
import window
from bpy_extras import view3d_utils
from mathutils import Vector
from window_hand import Run, Steps, choose, click, execute, hero, playing, press, rig, step, wait
from window_scene import shown_points


@step("modes")
def drag_a_bone(run: Run) -> Steps:
    """Rotates with R, X and a number, as on a keyboard, in pose mode."""
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.view_all()
    execute("object.mode_set", "Hero Rig", mode="POSE")
    bone = rig().pose.bones["bone.1"]
    rig().data.bones.active = bone.bone
    bone.select = True
    before = bone.matrix.copy()
    yield from wait()
    for key, text in (("R", ""), ("X", ""), ("FOUR", "4"), ("FIVE", "5")):
        press(key, text)
        yield from run.see(f"while dragging, after {key}")
    press("RET")
    yield from wait()
    run.check(bone.matrix != before, "the bone was not dragged")
    run.check_shapes("dragged")
    yield from run.undo("dragged and undone")
    execute("object.mode_set", mode="OBJECT")
    yield from run.check_frames()


def _enter_weight_paint() -> Steps:
    """With the armature's last bone active, and no active group."""
    execute("object.mode_set", "Hero Rig", mode="POSE")
    rig().data.bones.active = rig().data.bones["bone.2"]
    rig().pose.bones["bone.2"].select = True
    execute("object.mode_set", mode="OBJECT")
    hero().vertex_groups.active_index = -1
    choose("Hero", "Hero Rig")
    yield from wait()
    execute("object.mode_set", mode="WEIGHT_PAINT")
    yield from wait()


@step("modes")
def weight_paint(run: Run) -> Steps:
    """The armature goes to pose mode and the active bone's group becomes the active one, as without
    Sinew; paint is visible, also during playback."""
    found = []
    for is_on in (False, True):
        if not is_on:
            click("sinew.remove", "Hero")
        yield from _enter_weight_paint()
        _stroke()
        yield from wait()
        active = hero().vertex_groups.active
        found.append((active and active.name, rig().mode))
        if not is_on:
            execute("object.mode_set", mode="OBJECT")
            execute("object.mode_set", "Hero Rig", mode="OBJECT")
            click("sinew.add", "Hero")
            hero().sinew.method = "dq"
    run.check(found[0] == ("bone.2", "POSE"), f"without Sinew, they are {found[0]}")
    run.check(found[0] == found[1], f"active group and the armature's mode without Sinew and with: {found}")
    run.check_shapes("in weight paint")
    before = [group.weight for vertex in hero().data.vertices for group in vertex.groups]
    with playing():
        yield from wait(5)
        hero().vertex_groups.active_index = 1
        _stroke()
        yield from wait(5)
    yield from wait()
    after = [group.weight for vertex in hero().data.vertices for group in vertex.groups]
    run.check(before != after, "nothing was painted")
    run.check_shapes("painted while it played")
    yield from run.undo("painted and undone")
    run.save("painting.blend", copy=True)
    execute("object.mode_set", "Hero", mode="OBJECT")
    yield from run.check_frames()
    run.save("painted.blend", copy=True)
    click("sinew.remove", "Hero")
    run.wanted["Hero"] = ""
    modifier = hero().modifiers["Armature"]
    flags = (modifier.show_viewport, modifier.show_render)
    run.check(flags == (True, True), f"once Sinew is removed, the Armature modifier is on in {flags}")
    yield from run.see("without Sinew")
    press("Z", ctrl=True)
    run.wanted["Hero"] = "dq"
    yield from wait(4)
    yield from run.check_frames()


def _stroke() -> None:
    with window.in_view3d("WINDOW"):
        bpy.ops.paint.weight_paint("EXEC_DEFAULT", True, stroke=_points_of_stroke())


def _nearest_point() -> Vector:
    """The vertex of Hero's visible shape that is nearest to the viewer, in its own space."""
    depsgraph = bpy.context.window_manager.windows[0].view_layer.depsgraph
    to_view = bpy.context.space_data.region_3d.view_matrix @ hero().matrix_world
    return max(map(Vector, shown_points(hero(), depsgraph)), key=lambda point: (to_view @ point).z)


def _points_of_stroke(place: Vector | None = None) -> list[dict[str, object]]:
    """Moves the mouse over the middle of the view, or over a position on Hero, in its own space."""
    middle = bpy.context.region.width / 2, bpy.context.region.height / 2
    if place is not None:
        view, shown = bpy.context.space_data.region_3d, hero().matrix_world @ place
        middle = tuple(view3d_utils.location_3d_to_region_2d(bpy.context.region, view, shown))
    given = {
        "name": "",
        "location": tuple(place or (0.0,) * 3),
        "pressure": 1.0,
        "size": 200.0,
        "x_tilt": 0.0,
    }
    return [
        given
        | {"y_tilt": 0.0, "time": n / 10, "is_start": n == 0}
        | dict.fromkeys(("mouse", "mouse_event"), (middle[0] + 4.0 * n, middle[1]))
        for n in range(8)
    ]


@step("modes")
def sculpt(run: Run) -> Steps:
    """Under dq, which the Armature modifier shows with Preserve Volume: a stroke, frames, and undo with
    Ctrl Z."""
    modifier = hero().modifiers["Armature"]
    execute("object.mode_set", "Hero", mode="SCULPT")
    yield from wait()
    run.check(modifier.use_deform_preserve_volume, "Preserve Volume is not set in sculpt mode")
    run.check_shapes("in sculpt mode")
    before = np.empty(3 * len(hero().data.vertices), np.float32)
    after = before.copy()
    hero().data.vertices.foreach_get("co", before)
    with window.in_view3d("WINDOW"):
        bpy.ops.sculpt.brush_stroke("EXEC_DEFAULT", True, stroke=_points_of_stroke(_nearest_point()))
    yield from wait()
    hero().data.vertices.foreach_get("co", after)
    run.check(not np.array_equal(before, after), "nothing was sculpted")
    run.check_shapes("sculpted")
    yield from run.check_frames()
    press("Z", ctrl=True)
    yield from wait(4)
    hero().data.vertices.foreach_get("co", after)
    run.check(np.array_equal(before, after), "the stroke was not undone")
    run.check_shapes("the stroke undone")
    execute("object.mode_set", "Hero", mode="OBJECT")
    yield from wait()
    modifier = hero().modifiers["Armature"]
    run.check(not modifier.use_deform_preserve_volume, "Preserve Volume stays behind sculpt mode")
    run.check_shapes("after sculpt mode")
    for _time in range(2):
        press("Z", ctrl=True)
        yield from wait(4)
        is_sculpted = hero().mode == "SCULPT"
        has_volume = hero().modifiers["Armature"].use_deform_preserve_volume
        run.check(has_volume == is_sculpted, f"undone, Preserve Volume is {has_volume} in {hero().mode}")
        run.check_shapes(f"undone to {hero().mode}")
    execute("object.mode_set", "Hero", mode="OBJECT")
    yield from run.check_frames()


@step("modes")
def methods_while_it_plays(run: Run) -> Steps:
    with playing():
        for method in ("lbs", "dq", "qv", "dq", "lbs", "dq"):
            hero().sinew.method = method
            yield from wait(4)
        hero().sinew.enabled = False
        yield from wait(4)
        hero().sinew.enabled = True
        click("sinew.rebind", "Hero")
        yield from wait(4)
    yield from run.see("after playback")
    yield from run.check_frames()
