# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes about which Blender does not notify Sinew while it deforms a character; each caused a fault
once."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach, properties
from sinew_addon.deform import characters, safe_mode, session, update
from sinew_addon.deform.plan import State
from sinew_addon.io import mesh_io
from sinew_addon.ui import state_text
from test_editing import assert_follows

pytestmark = pytest.mark.both_ways


def test_swapped_bone_names_swap_the_groups():
    obj, armature = scenes.skinned_arm()
    bones = armature.data.bones
    bones["bone.0"].name = "x"
    bones["bone.1"].name = "bone.0"
    bones["x"].name = "bone.1"
    bpy.context.view_layer.update()
    assert [group.name for group in obj.vertex_groups] == ["bone.1", "bone.0"]
    assert_follows(obj)


def test_a_bone_renamed_and_another_made_in_one_edit():
    obj, armature = scenes.skinned_arm()
    scenes.enter(armature, "EDIT")
    bpy.context.view_layer.update()
    armature.data.edit_bones["bone.1"].name = "forearm"
    extra = armature.data.edit_bones.new("extra")
    extra.head, extra.tail = (0, 0, 1), (0, 0, 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [group.name for group in obj.vertex_groups] == ["bone.0", "forearm"]
    assert_follows(obj)


@pytest.mark.parametrize("heat", [False, True])
def test_while_off_the_mesh_has_no_attribute_of_sinews(heat):
    obj, _armature = scenes.skinned_arm("qv")
    properties.of(obj).heat = heat
    frames = [3, 7]
    shown = scenes.shapes(obj, frames)

    def ours() -> list[str]:
        return [attribute.name for attribute in obj.data.attributes if "sinew" in attribute.name]

    # The points of a mesh with a heat map are stored in a separate object.
    assert len(ours()) == (not heat)
    for _again in range(2):
        properties.of(obj).enabled = False
        bpy.context.scene.frame_set(5)
        assert ours() == []
        properties.of(obj).enabled = True
        assert np.array_equal(scenes.shapes(obj, frames), shown)
        assert len(ours()) == (not heat)


def test_points_that_are_never_requested_are_deformed_after_the_update(monkeypatch):
    obj, _armature = scenes.skinned_arm("dq")
    expected = scenes.shapes(obj, [3, 6, 11])
    monkeypatch.setattr(session.requests, "mesh_requested", lambda _mesh: None)
    monkeypatch.setattr(properties.listeners, "mesh_requested", lambda _mesh: None)
    scenes.shapes(obj, [1, 2])
    assert np.array_equal(scenes.shapes(obj, [3, 6, 11]), expected)
    state = session.state_of(obj)
    assert state.plan.state is State.AFTER_UPDATE
    assert update.NOT_REQUESTED in state.plan.reason
    assert any(update.NOT_REQUESTED in each for each in state_text.problems_of(obj))


@pytest.mark.usefixtures("route")
def test_a_character_appended_in_place_of_two_objects(tmp_path):
    obj, armature = scenes.skinned_arm("dq")
    expected = scenes.shapes(obj, [11])
    path = str(tmp_path / "arm.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    obj_name, armature_name = obj.name, armature.name
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    others = [scenes.added("Empty", None) for _number in range(2)]
    bpy.context.view_layer.update()
    for other in others:
        bpy.data.objects.remove(other)
    appended = scenes.link_here(path, obj_name, armature_name, link=False)[0]
    assert np.array_equal(scenes.shapes(appended, [11]), expected)


@pytest.mark.usefixtures("route")
def test_two_objects_swap_their_names():
    obj, armature = scenes.make_arm()
    other, other_armature = scenes.make_arm(name="Other")
    bpy.data.objects.remove(other_armature)
    other.modifiers["Armature"].object = armature
    other.vertex_groups[1].add(list(range(80, 200)), 0.2, "REPLACE")
    for each in (obj, other):
        scenes.add_sinew(each, "dq")
    expected = [scenes.shapes(each, [11]) for each in (obj, other)]
    bpy.context.scene.frame_set(5)
    obj.name, other.name, obj.name = "Third", "Arm", "Other"
    seen = []
    with scenes.handler(
        "frame_change_post", lambda *_args: seen.append(scenes.final_points(obj)), first=True
    ):
        bpy.context.scene.frame_set(11)
    for each, shape in zip((obj, other), expected, strict=True):
        assert np.array_equal(scenes.final_points(each), shape[0])
    assert safe_mode.is_on() or np.array_equal(seen[0], expected[0][0])


def test_what_the_artist_switched_while_off_stays():
    obj, _armature = scenes.skinned_arm()
    properties.of(obj).enabled = False
    obj.modifiers["Armature"].show_render = False
    properties.of(obj).enabled = True
    attach.remove(obj)
    assert obj.modifiers["Armature"].show_viewport
    assert not obj.modifiers["Armature"].show_render


def test_a_driver_that_gives_no_method_is_said_so():
    obj, _armature = scenes.skinned_arm("dq")
    driver = obj.driver_add("sinew.method").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = obj, '["number"]'
    for number, error in ((1, ""), (999, "the driver of its method")):
        obj["number"] = number
        scenes.rebind(obj)
        bpy.context.scene.frame_set(11)
        bpy.context.view_layer.update()
        assert error in properties.of(obj).error
    assert properties.of(obj).enabled
    assert session.plan_of(obj).state is State.REFUSED


def test_a_new_method_reads_only_changed_weights(monkeypatch):
    obj, _armature = scenes.make_arm()
    characters.use_method(obj, "dq")
    bpy.context.scene.frame_set(11)
    reads, read = [], mesh_io.read_group_weights
    monkeypatch.setattr(mesh_io, "read_group_weights", lambda mesh: reads.append(mesh) or read(mesh))
    bpy.context.view_layer.update()
    reads.clear()
    for method in ("lbs", "qv", "dq"):
        characters.use_method(obj, method)
        bpy.context.scene.frame_set(10)
        bpy.context.scene.frame_set(11)
    assert reads == []
    before = scenes.final_points(obj)
    obj.vertex_groups["bone.1"].remove(range(len(obj.data.vertices)))
    obj.data.update()
    characters.use_method(obj, "lbs")
    assert len(reads) == 1
    expected = scenes.rest_points(obj)
    assert scenes.worst(before, expected) > 0.1
    characters.use_method(obj, "blender")
    expected = scenes.final_points(obj)
    characters.use_method(obj, "lbs")
    assert scenes.worst(scenes.final_points(obj), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_what_is_kept_of_many_modifiers_is_of_each():
    """Blender moves all of them in memory when more are added."""
    obj, armature = scenes.make_arm()
    for number in range(20):
        obj.modifiers.new(f"More {number}", "ARMATURE").object = armature
    pairs = attach.replaced_modifiers(obj)
    there = properties.of(obj).replaced_modifiers
    assert [kept.as_pointer() for _modifier, kept in pairs] == [kept.as_pointer() for kept in there]
    assert [kept.name for kept in there] == [modifier.name for modifier in obj.modifiers]
