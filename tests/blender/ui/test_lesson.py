# SPDX-License-Identifier: GPL-3.0-or-later
"""The lesson: what its page says is true, its names are those of buttons, and opening it loses nothing."""

from __future__ import annotations

import runpy
from pathlib import Path

import bpy
import five_meshes
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.features.compare import comparison_state
from sinew_addon.ui import lesson

pytestmark = pytest.mark.long_term

ROOT = Path(__file__).resolve().parents[3]
PAGE = runpy.run_path(str(ROOT / "blend_files" / "make_lesson.py"))["LESSON"]


@pytest.fixture
def opened():
    bpy.ops.wm.open_mainfile(filepath=str(lesson.FILE), load_ui=True)


def measured(obj):
    return scenes.measure(obj).measured


def click(name):
    obj = bpy.data.objects[name]
    five_meshes.select(obj)
    return obj


def test_the_file_is_small_and_has_nothing_of_sinew(opened):
    assert lesson.FILE.stat().st_size < 500_000
    assert bpy.data.texts["Lesson"].as_string() == PAGE
    assert not any(properties.has_sinew(obj) for obj in bpy.data.objects)
    assert not [group for group in bpy.data.node_groups if "Sinew" in group.name]
    assert not bpy.context.selected_objects
    types = [area.type for area in bpy.data.workspaces["Layout"].screens[0].areas]
    assert {"TEXT_EDITOR", "VIEW_3D"} <= set(types)


@pytest.mark.slow
def test_what_the_page_says_holds(opened):
    scene = bpy.context.scene
    assert scene.frame_current == 16
    assert "At frame 16 the wrist is pinched and the elbow flat" in PAGE
    shapes = {name: scenes.final_points(bpy.data.objects[name]) for name in ("Wrist", "Elbow")}

    assert 'Click "Add Sinew". Nothing moves' in PAGE
    hand = click("Wrist")
    assert bpy.ops.sinew.add() == {"FINISHED"}
    assert scenes.worst(shapes["Wrist"], scenes.final_points(hand)) < 1e-6
    # For a wrist with a radius of about 3 cm.
    assert measured(hand).entry("bulge_min") < -0.01
    assert 'take "Dual Quaternion". The wrist is round again.' in PAGE
    scene.sinew_character.method = "dq"
    assert abs(measured(hand).entry("bulge_min")) < 0.0005

    assert '"Dual Quaternion". The elbow is not flat any more, but it bulges.' in PAGE
    arm = click("Elbow")
    assert bpy.ops.sinew.add(method="lbs") == {"FINISHED"}
    linear = measured(arm)
    assert linear.entry("bulge_min") < -0.02
    scene.sinew_character.method = "dq"
    dual = measured(arm)
    assert dual.entry("bulge_min") > 0.65 * linear.entry("bulge_min")
    assert dual.entry("bulge_max") > 0.005 > 5 * linear.entry("bulge_max")
    assert 'switch "Limit Bulge" on: the bulge is all but gone.' in PAGE
    scene.sinew_character.bulge_limit.enabled = True
    assert measured(arm).entry("bulge_max") < 0.25 * dual.entry("bulge_max")

    assert bpy.ops.sinew.heat_map() == {"FINISHED"}
    assert properties.of(arm).heat
    bpy.ops.sinew.heat_map()
    assert not properties.of(arm).heat
    assert 'choose "Linear Blend" and OK: a copy stands beside.' in PAGE
    assert bpy.ops.sinew.compare(methods={"lbs"}) == {"FINISHED"}
    assert len([obj for obj in bpy.data.objects if properties.is_copy(obj)]) == 1
    assert bpy.ops.sinew.flip_comparison() == {"FINISHED"}
    bpy.ops.sinew.end_comparison()
    assert comparison_state.of_scene(scene) is None
    assert bpy.ops.sinew.suggest(over="SCENE") == {"FINISHED"}
    assert bpy.ops.sinew.bake(kind="bones", motion="pose", frames="1,8,16,24") == {"FINISHED"}
    assert any(bone.constraints for bone in bpy.data.objects["Elbow Rig"].pose.bones)


def test_what_is_not_saved_is_not_lost():
    """In a window Blender asks: test_features_in_window.py."""
    bpy.data.objects.new("Unsaved", None)
    bpy.ops.ed.undo_push(message="work")
    assert bpy.data.is_dirty
    with pytest.raises(RuntimeError, match="Save this file first"):
        bpy.ops.sinew.open_lesson()
    assert "Unsaved" in bpy.data.objects
