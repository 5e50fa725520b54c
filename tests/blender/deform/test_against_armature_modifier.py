# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Armature modifier is the oracle: linear for lbs, Preserve Volume for dq. What random rigs in a
pose have is in the fuzzer; here are real rigs, frames, modes and what is switched meanwhile."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from conftest import BLEND_FILES, REAL_RIGS
from sinew_addon.attach import attach, properties, stack
from sinew_addon.io import files, mesh_io
from sinew_addon.ui import state_text

ORACLES = [("lbs", False), ("dq", True)]


def assert_equal_to_modifier(obj: bpy.types.Object, frames: list[float]) -> None:
    expected = {method: scenes.modifier_shapes(obj, frames, volume) for method, volume in ORACLES}
    scenes.add_sinew(obj)
    for method, _volume in ORACLES:
        properties.of(obj).method = method
        got = scenes.shapes(obj, frames)
        assert properties.of(obj).enabled, properties.of(obj).error
        assert scenes.worst(got, expected[method]) <= scenes.TOLERANCE * scenes.diagonal(obj), method


@pytest.mark.parametrize("path", BLEND_FILES, ids=lambda path: path.stem)
def test_own_rigs_at_every_frame(path):
    files.open_file(path)
    assert_every_mesh_equal()


@pytest.mark.parametrize("name", REAL_RIGS)
def test_real_rigs_at_every_frame(real_rig, name):
    files.open_file(real_rig(name))
    assert_every_mesh_equal()


def assert_every_mesh_equal():
    scene = bpy.context.scene
    meshes = attach.deformed_meshes(list(scene.objects))
    assert meshes
    for obj in meshes:
        assert_equal_to_modifier(obj, list(range(scene.frame_start, scene.frame_end + 1)))


def test_far_from_the_origin():
    obj, armature = scenes.make_arm()
    obj.location = armature.location = (300.0, -200.0, 100.0)
    bpy.context.view_layer.update()
    assert_equal_to_modifier(obj, [1, 6, 11])


def final_points_in_any_mode(obj: bpy.types.Object) -> np.ndarray:
    """In edit mode the evaluated mesh differs from what it converts to."""
    evaluated = scenes.evaluated(obj)
    points = mesh_io.read_points(evaluated.to_mesh())
    evaluated.to_mesh_clear()
    return points


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT"])
def test_the_panel_says_whether_the_modifiers_shape_is_sinews(mode):
    obj, _armature = scenes.make_arm()
    bpy.context.scene.frame_set(8)
    modifier = obj.modifiers["Armature"]
    modifier.show_in_editmode = True
    scenes.add_sinew(obj, "dq")
    ours = scenes.final_points(obj)
    bpy.ops.object.mode_set(mode=mode)
    bpy.context.view_layer.update()
    assert scenes.worst(final_points_in_any_mode(obj), ours) <= 1e-6
    sentence = "The shape is the same: Dual Quaternion. Preserve Volume is switched for it meanwhile"
    assert state_text.shape_in_mode(obj) == (sentence, [])
    # As by hand: it remains, and the panel has the switch.
    modifier.use_deform_preserve_volume = False
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(9)
    bpy.context.scene.frame_set(8)
    assert scenes.worst(final_points_in_any_mode(obj), ours) > 0.01
    assert state_text.shape_in_mode(obj) == (
        "Switch Preserve Volume to see Dual Quaternion here, too",
        [modifier],
    )
    modifier.use_deform_preserve_volume = True
    properties.of(obj).bulge_limit.enabled = True
    sentence, to_switch = state_text.shape_in_mode(obj)
    assert "another shape" in sentence
    assert to_switch == []
    # It has no effect there.
    assert not modifier.use_deform_preserve_volume
    properties.of(obj).bulge_limit.enabled = False
    assert modifier.use_deform_preserve_volume
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert not modifier.use_deform_preserve_volume
    assert np.array_equal(scenes.final_points(obj), ours)


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT"])
def test_the_method_changes_in_a_mode_of_the_modifier(mode):
    """Also for the method of the artist's own Preserve Volume."""
    obj, _armature = scenes.make_arm()
    modifier = obj.modifiers["Armature"]
    modifier.show_in_editmode = modifier.use_deform_preserve_volume = True
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(8)
    shapes = {}
    for method in ("lbs", "dq"):
        properties.of(obj).method = method
        shapes[method] = scenes.final_points(obj)
    bpy.ops.object.mode_set(mode=mode)
    bpy.context.view_layer.update()
    for method in ("lbs", "dq", "lbs"):
        properties.of(obj).method = method
        assert scenes.worst(final_points_in_any_mode(obj), shapes[method]) <= 1e-6
        end = ". Preserve Volume is switched for it meanwhile" if method == "lbs" else ""
        label = properties.method_label(method)
        assert state_text.shape_in_mode(obj) == (f"The shape is the same: {label}{end}", [])
    bpy.ops.sinew.remove()
    assert modifier.use_deform_preserve_volume


def test_chained_modifiers_have_a_volume_each_in_sculpt_mode():
    obj, armature = scenes.make_arm()
    second = obj.modifiers.new("Second", "ARMATURE")
    second.object, second.use_multi_modifier = armature, True
    second.vertex_group = "bone.1"
    scenes.add_sinew(obj, "dq")
    properties.of(obj).replaced_modifiers["Second"].method = "lbs"
    bpy.context.scene.frame_set(8)
    ours = scenes.final_points(obj)
    bpy.ops.object.mode_set(mode="SCULPT")
    bpy.context.view_layer.update()
    assert scenes.worst(final_points_in_any_mode(obj), ours) <= 1e-6
    assert [m.use_deform_preserve_volume for m in (obj.modifiers["Armature"], second)] == [True, False]


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT"])
def test_modes_in_which_blenders_tools_need_the_modifier(mode):
    obj, _armature = scenes.make_arm()
    bpy.context.scene.frame_set(8)
    obj.modifiers["Armature"].show_in_editmode = True
    bpy.ops.object.mode_set(mode=mode)
    expected = final_points_in_any_mode(obj)
    bpy.ops.object.mode_set(mode="OBJECT")
    shown = scenes.final_points(obj)
    # No modifier of Blender has this method.
    scenes.add_sinew(obj, "qv")
    bpy.ops.object.mode_set(mode=mode)
    bpy.context.view_layer.update()
    assert scenes.worst(final_points_in_any_mode(obj), expected) == 0.0
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    obj.sinew.method = "lbs"
    assert scenes.worst(scenes.final_points(obj), shown) <= 1e-6
    assert stack.sinew_modifier(obj).show_viewport
