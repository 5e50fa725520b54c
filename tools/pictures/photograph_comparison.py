# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the methods on human.blend in a Blender with a window, and photographs it.

    blender --factory-startup human.blend --python photograph_comparison.py -- sinew.zip comparison.png

Prints as facts what became of it on playback, posing, flipping, undo, saving, reopening and at its end.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import window

ZIP, PICTURE = window.arguments()
FRAME = 32
# Blender leaves much room around what it shows.
CLOSER = 0.7
METHODS = {"lbs", "qv", "dq"}


def human() -> bpy.types.Object:
    return bpy.data.objects["Human"]


def copy(method: str) -> bpy.types.Object:
    return next(obj for obj in bpy.data.objects if obj.type == "MESH" and obj.sinew.identity.method == method)


def worst(place: int = 1) -> float:
    """How far the linear copy, at its place in the row, is from the original, which the modifier deforms."""
    state = bpy.context.scene.sinew_comparison
    shown = copy("lbs")
    offset = place * state.spacing * np.array(state.axis)
    moved = window.final_points(shown) - np.linalg.solve(np.array(shown.matrix_world)[:3, :3], offset)
    return float(np.abs(moved - window.final_points(human())).max())


def names() -> list[str]:
    """Of all that a comparison could leave."""
    kinds = ("objects", "meshes", "node_groups", "collections", "actions")
    attributes = [attribute.name for attribute in human().data.attributes]
    return sorted(item.name for kind in kinds for item in getattr(bpy.data, kind)) + attributes


def press(operator: str, **options: object) -> None:
    with window.in_view3d():
        group, name = operator.split(".")
        assert getattr(getattr(bpy.ops, group), name)("EXEC_DEFAULT", True, **options) == {"FINISHED"}


def bend(degrees: float) -> None:
    bone = bpy.data.objects["Rig"].pose.bones["upperarm_r"]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = (0.0, 0.0, np.radians(degrees))


def look_at_all() -> None:
    """From the front, as large as the room beside the sidebar lets it."""
    with window.in_view3d("WINDOW"):
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_all()
        bpy.context.space_data.show_region_hud = False
        bpy.context.space_data.overlay.show_cursor = False
        view = bpy.context.region_data
        view.view_distance *= CLOSER
        view.view_location.x += 0.09 * view.view_distance


def steps():
    window.install(ZIP)
    bpy.context.scene.frame_set(FRAME)
    window.select_only(human())
    with window.in_view3d():
        bpy.ops.screen.screen_full_area()
    yield
    window.open_sidebar()
    yield
    yield
    window.choose_tab()
    # The copies stand along what is right in the view.
    look_at_all()
    yield
    yield
    before = names()
    press("sinew.compare", methods=METHODS)
    look_at_all()
    yield
    yield
    window.photograph(PICTURE)
    facts = {"diagonal": float(np.linalg.norm(human().dimensions))}
    yield from work(facts)
    press("sinew.end_comparison")
    yield
    facts["left"] = sorted(set(names()) ^ set(before))
    print("FACTS " + json.dumps(facts), flush=True)


def work(facts: dict[str, object]):
    """What an artist does while comparing."""
    scene = bpy.context.scene
    press("screen.animation_play")
    for _second in range(3):
        yield
    with window.in_view3d():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    yield
    facts["played"] = scene.frame_current != FRAME
    facts["worst played"] = worst()
    scene.frame_set(FRAME)
    rest = window.final_points(copy("dq"))
    bend(60.0)
    yield
    facts["posed"] = float(np.abs(window.final_points(copy("dq")) - rest).max())
    facts["worst posed"] = worst()
    shown = []
    for _flip in range(3):
        press("sinew.flip_comparison")
        yield
        shown.append([method for method in sorted(METHODS) if copy(method).visible_get()])
    facts["flipped"] = shown
    scene.sinew_comparison.arrangement = "OVERLAY"
    yield
    facts["worst overlaid"] = worst()
    scene.sinew_comparison.arrangement = "SIDE"
    with window.in_view3d():
        bpy.ops.ed.undo_push(message="Arrangement")
    press("sinew.compare", methods={"dq"})
    yield
    press("ed.undo")
    yield
    facts["after undo"] = sorted(
        obj.sinew.identity.method for obj in bpy.data.objects if obj.sinew.identity.method
    )
    facts["worst after undo"] = worst()
    saved = PICTURE.with_suffix(".blend")
    press("wm.save_as_mainfile", filepath=str(saved), copy=True)
    press("wm.open_mainfile", filepath=str(saved), load_ui=False)
    yield
    bpy.context.scene.frame_set(FRAME + 4)
    yield
    facts["worst reopened"] = worst()
    saved.unlink()


window.run(steps())
