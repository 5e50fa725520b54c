# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes about which Blender does not notify Sinew while it deforms a character; each caused a fault
once."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import sinew_addon
import walk_sides
from sinew_addon.attach import attach, properties
from sinew_addon.deform import characters, safe_mode, session, update
from sinew_addon.deform.plan import State
from sinew_addon.io import animation_paths, mesh_io
from sinew_addon.ui import state_text
from test_editing import assert_follows


@pytest.fixture
def keyed():
    """An arm with Sinew and two shape keys, the second at half."""
    obj, armature = scenes.make_arm()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="wide")
    key.data.foreach_set("co", (1.2 * scenes.rest_points(obj)).ravel())
    key.value = 0.5
    scenes.add_sinew(obj)
    scenes.shapes(obj, [1, 6])
    return obj, armature


def test_a_shape_key_edited_added_and_removed(keyed):
    obj, _armature = keyed
    keys = obj.data.shape_keys
    keys.key_blocks["wide"].data[7].co.z += 0.3
    obj.data.update_tag()
    bpy.context.view_layer.update()
    assert_follows(obj)
    obj.shape_key_add(name="another").value = 1.0
    bpy.context.view_layer.update()
    assert_follows(obj)
    obj.shape_key_remove(keys.key_blocks["wide"])
    bpy.context.view_layer.update()
    assert_follows(obj)


def test_a_slider_moved_and_weights_after_it(keyed):
    obj, _armature = keyed
    obj.data.shape_keys.key_blocks["wide"].value = 0.9
    bpy.context.view_layer.update()
    assert_follows(obj)
    obj.vertex_groups[1].add(list(range(60, 90)), 0.2, "REPLACE")
    bpy.context.view_layer.update()
    assert_follows(obj)


def test_first_shape_keys_of_a_driven_mesh():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    scenes.shapes(obj, [1, 6])
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="lifted").data[3].co.z += 1.0
    obj.data.shape_keys.key_blocks["lifted"].value = 1.0
    assert_follows(obj)


@pytest.mark.parametrize("mute", [False, True])
def test_a_pinned_shape_key(keyed, mute):
    obj, _armature = keyed
    obj.active_shape_key_index = 1
    obj.data.shape_keys.key_blocks["wide"].mute = mute
    obj.show_only_shape_key = True
    assert_follows(obj)
    obj.show_only_shape_key = False
    assert_follows(obj)


def test_hidden_armature_after_off_and_on():
    obj, armature = scenes.make_arm()
    expected = scenes.modifier_shapes(obj, [11], preserve_volume=False)[0]
    scenes.add_sinew(obj)
    properties.of(obj).enabled = False
    properties.of(obj).enabled = True
    armature.hide_viewport = armature.hide_render = True
    bpy.context.scene.frame_set(1)
    bpy.context.scene.frame_set(11)
    assert scenes.worst(scenes.final_points(obj), expected) <= 1e-5


def test_swapped_bone_names_swap_the_groups():
    obj, armature = scenes.make_arm()
    scenes.add_sinew(obj)
    bones = armature.data.bones
    bones["bone.0"].name = "x"
    bones["bone.1"].name = "bone.0"
    bones["x"].name = "bone.1"
    bpy.context.view_layer.update()
    assert [group.name for group in obj.vertex_groups] == ["bone.1", "bone.0"]
    assert_follows(obj)


def test_a_bone_renamed_and_another_made_in_one_edit():
    obj, armature = scenes.make_arm()
    scenes.add_sinew(obj)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.view_layer.update()
    armature.data.edit_bones["bone.1"].name = "forearm"
    extra = armature.data.edit_bones.new("extra")
    extra.head, extra.tail = (0, 0, 1), (0, 0, 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [group.name for group in obj.vertex_groups] == ["bone.0", "forearm"]
    assert_follows(obj)


@pytest.mark.usefixtures("route")
def test_a_bone_made_while_sinew_is_off():
    obj, armature = scenes.make_arm()
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(4)
    properties.of(obj).enabled = False
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones["bone.0"].roll += 0.5
    armature.data.edit_bones.new("extra").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    properties.of(obj).enabled = True
    assert not properties.of(obj).error
    assert_follows(obj)


def test_bones_are_edited_on_the_rest_shape():
    obj, armature = scenes.make_arm()
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(11)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) <= 1e-6
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_follows(obj)


@pytest.mark.usefixtures("route")
def test_undo_in_edit_mode_of_a_shared_armature():
    """In edit mode Blender then only shows the object that the artist edits, and the bones of both."""
    obj, armature = scenes.make_arm()
    sharing = armature.copy()
    bpy.context.scene.collection.objects.link(sharing)
    obj.modifiers["Armature"].object = sharing
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(11)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.ed.undo_push(message="In edit mode")
    armature.data.edit_bones.new("extra").tail = (0, 0, 1)
    bpy.ops.ed.undo_push(message="A bone more")
    bpy.ops.ed.undo()
    obj, sharing = bpy.data.objects["Arm"], bpy.data.objects[sharing.name]
    assert sharing.data.is_editmode
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) <= 1e-6
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_follows(obj)


def test_the_final_mesh_has_no_attribute_of_sinews():
    obj, _armature = scenes.make_arm()
    obj.modifiers.new("Subdivision", "SUBSURF")
    obj.data.attributes.new("own", "FLOAT", "POINT")
    scenes.add_sinew(obj)
    scenes.shapes(obj, [1, 6])
    final = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert len(final.vertices) > len(obj.data.vertices)
    names = set(final.attributes.keys())
    assert "own" in names
    assert not any(name.startswith("sinew") for name in names)


@pytest.mark.parametrize("heat", [False, True])
def test_while_off_the_mesh_has_no_attribute_of_sinews(heat):
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "qv")
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


@pytest.mark.by_sinew
def test_a_deleted_attribute_is_written_again():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(11)
    expected = scenes.final_points(obj)
    obj.data.attributes.remove(obj.data.attributes[properties.of(obj).attribute])
    bpy.context.view_layer.update()
    assert np.array_equal(scenes.final_points(obj), expected)


def _mute_drivers(obj: bpy.types.Object) -> None:
    for driver in obj.animation_data.drivers:
        driver.mute = True


@pytest.mark.parametrize(
    "take",
    [
        lambda obj: bpy.data.node_groups.remove(obj.modifiers["Sinew"].node_group),
        lambda obj: obj.modifiers["Sinew"].node_group.nodes.clear(),
        lambda obj: obj.modifiers["Sinew"].node_group.links.clear(),
        lambda obj: obj.modifiers["Sinew"].node_group.interface.clear(),
        _mute_drivers,
    ],
    ids=["group", "nodes", "links", "interface", "driver"],
)
@pytest.mark.usefixtures("route")
def test_deleted_parts_of_sinew_are_made_again(take):
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
    expected = scenes.shapes(obj, [6, 11])
    take(obj)
    bpy.context.view_layer.update()
    assert np.array_equal(scenes.final_points(obj), expected[1])
    take(obj)
    assert np.array_equal(scenes.shapes(obj, [6, 11]), expected)
    assert not properties.of(obj).error


@pytest.mark.parametrize("heat", [False, True])
def test_what_is_taken_of_a_hidden_objects_group_is_made_again(heat):
    """Blender does not list a group as changed that no evaluated object has."""
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
    properties.of(obj).heat = heat
    expected = scenes.shapes(obj, [6, 11])
    obj.hide_viewport = True
    bpy.context.view_layer.update()
    obj.modifiers["Sinew"].node_group.interface.clear()
    obj.update_tag()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Empty", None))
    bpy.context.view_layer.update()
    obj.hide_viewport = False
    assert np.array_equal(scenes.shapes(obj, [6, 11]), expected)
    assert not properties.of(obj).error


def test_points_that_are_never_requested_are_deformed_after_the_update(monkeypatch):
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
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
    obj, armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
    expected = scenes.shapes(obj, [11])
    path = str(tmp_path / "arm.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    names = [obj.name, armature.name]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    others = [bpy.data.objects.new("Empty", None) for _number in range(2)]
    for other in others:
        bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    for other in others:
        bpy.data.objects.remove(other)
    with bpy.data.libraries.load(path) as (_source, target):
        target.objects = names
    for appended in target.objects:
        bpy.context.scene.collection.objects.link(appended)
    assert np.array_equal(scenes.shapes(target.objects[0], [11]), expected)


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
    monitor = bpy.app.handlers.frame_change_post
    monitor.insert(0, lambda *_args: seen.append(scenes.final_points(obj)))
    try:
        bpy.context.scene.frame_set(11)
    finally:
        monitor.pop(0)
    for each, shape in zip((obj, other), expected, strict=True):
        assert np.array_equal(scenes.final_points(each), shape[0])
    assert safe_mode.is_on() or np.array_equal(seen[0], expected[0][0])


def test_one_user_of_a_shared_mesh_in_edit_mode():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    bpy.context.scene.frame_set(3)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.scene.frame_set(6)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_follows(obj)
    assert_follows(other)


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("which", ["armature", "mesh", "both"])
def test_an_object_without_size_is_as_blender_shows_it(rendered_points, which):
    obj, armature = scenes.make_arm()
    obj.location, obj.rotation_euler = (1.0, -0.5, 0.2), (0.3, 1.0, -0.4)
    armature.rotation_euler = (0.2, 0.1, 0.7)
    if which == "both":
        obj.parent = armature
    flat = {"armature": (1.0, 0.0, 1.0), "mesh": (0.0, 1.0, 0.5), "both": (1.0, 1.0, 0.0)}[which]
    scales = ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), flat, (1.0, 1.0, 1.0))

    def shapes(scaled: bpy.types.Object) -> list[np.ndarray]:
        found = []
        for frame, scale in zip((11, 6, 8, 6), scales, strict=True):
            bpy.context.scene.frame_set(frame)
            scaled.scale = scale
            found += [scenes.final_points(obj), rendered_points(obj)]
        return found

    scaled = obj if which == "mesh" else armature
    wanted = shapes(scaled)
    scenes.add_sinew(obj, "lbs")
    for got, its in zip(shapes(scaled), wanted, strict=True):
        # From 5.0 on a mesh has points far away, that its scale of 0 brings back: rounding decides where.
        size = max(scenes.diagonal(obj), float(np.abs(its).max()))
        assert which == "both" or scenes.worst(got, its) <= scenes.TOLERANCE * size
    for method in properties.METHODS:
        properties.of(obj).method = method
        for scale in scales[1:3]:
            scaled.scale = scale
            by_frame = []
            for before in (1, 11):
                scenes.shapes(obj, [before])
                by_frame.append(scenes.shapes(obj, [5]))
            assert np.isfinite(by_frame[0]).all()
            assert np.array_equal(*by_frame)
        scaled.scale = (1.0, 1.0, 1.0)
    assert not properties.of(obj).error


def test_what_the_artist_switched_while_off_stays():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    properties.of(obj).enabled = False
    obj.modifiers["Armature"].show_render = False
    properties.of(obj).enabled = True
    attach.remove(obj)
    assert obj.modifiers["Armature"].show_viewport
    assert not obj.modifiers["Armature"].show_render


def test_no_attribute_stays_after_a_linked_duplicate_is_made_single():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    bpy.context.scene.frame_set(3)
    other.data = other.data.copy()
    for each in (obj, other):
        attach.remove(each)
        assert not [a.name for a in each.data.attributes if a.name.startswith("sinew")]


def test_linked_characters_say_so_and_keep_moving(tmp_path):
    obj, _armature = scenes.make_arm()
    expected = scenes.modifier_shapes(obj, [1, 11], preserve_volume=True)
    scenes.add_sinew(obj, "dq")
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    obj, _armature = scenes.link(path, "Arm", "Arm Rig")
    assert scenes.worst(scenes.shapes(obj, [1, 11]), expected) <= 1e-5
    assert "make a library override" in session.plan_of(obj).reason
    # A library override made later would inherit what is written into linked data.
    assert properties.of(obj).enabled
    assert not properties.of(obj).error


def test_registered_with_a_driven_file_open():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
    sinew_addon.unregister()
    bpy.context.scene.frame_set(11)
    sinew_addon.register()
    bpy.context.view_layer.update()
    shown = scenes.final_points(obj)
    bpy.context.scene.frame_set(3)
    bpy.context.scene.frame_set(11)
    assert scenes.worst(shown, scenes.final_points(obj)) <= 1e-6


@pytest.mark.parametrize("safe", [False, True])
def test_registered_on_another_frame_than_the_keys(monkeypatch, safe):
    monkeypatch.setattr(safe_mode, "_forced", safe)
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
    for frame, method in ((1, "lbs"), (8, "dq")):
        bpy.context.scene.frame_set(frame)
        properties.of(obj).method = method
        obj.keyframe_insert("sinew.method", frame=frame)
    bpy.context.scene.frame_set(9)
    sinew_addon.unregister()
    bpy.context.scene.frame_set(3)
    sinew_addon.register()
    got = scenes.final_points(obj)
    bpy.context.scene.frame_set(3)
    assert properties.of(obj).method == "lbs"
    assert scenes.worst(got, scenes.final_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_driver_that_gives_no_method_is_said_so():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj, "dq")
    driver = obj.driver_add("sinew.method").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = obj, '["number"]'
    for number, error in ((1, ""), (999, "the driver of its method")):
        obj["number"] = number
        session.rebind(obj, bpy.context)
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


def test_a_heat_map_of_a_mesh_that_two_objects_have():
    """Sinew then deforms after the update, with points that no evaluation has written to the file."""
    obj, _armature = scenes.make_arm()
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(6)
    expected = scenes.final_points(other)
    assert scenes.worst(scenes.final_points(obj), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    properties.of(obj).heat = True
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("heat", [False, True])
def test_the_first_of_two_armatures_is_deleted(heat):
    obj, armature = scenes.make_arm()
    _other, other_armature = scenes.make_arm(name="Other")
    obj.modifiers.new("Second", "ARMATURE").object = other_armature
    scenes.add_sinew(obj)
    properties.of(obj).heat = heat
    bpy.data.objects.remove(armature)
    bpy.context.view_layer.update()
    assert properties.of(obj).error == ""
    assert_follows(obj)


def test_a_bone_is_deleted_while_its_armature_is_in_edit_mode():
    obj, armature = scenes.make_arm(bones=3)
    scenes.add_sinew(obj)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.remove(armature.data.edit_bones[2])
    armature.update_from_editmode()
    obj.vertex_groups.new(name="another")
    obj.update_tag()
    bpy.context.view_layer.update()
    assert properties.of(obj).error == ""
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_follows(obj)


@pytest.mark.parametrize("then", ["on", "off", "removed"])
def test_deleted_keys_of_visibility_leave_their_last_value(then):
    obj, _armature = scenes.make_arm()
    modifier = obj.modifiers["Armature"]
    for frame, shown in ((1, False), (5, True)):
        modifier.show_viewport = shown
        modifier.keyframe_insert("show_viewport", frame=frame)
    bpy.context.scene.frame_set(11)
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(4)
    obj.animation_data_clear()
    if then == "off":
        properties.of(obj).enabled = False
    elif then == "removed":
        attach.remove(obj)
    bpy.context.scene.frame_set(6)
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) <= 1e-6
    if then != "on":
        assert not modifier.show_viewport


@pytest.mark.usefixtures("route")
def test_deleted_keys_of_visibility_where_the_modifier_is_on():
    obj, _armature = scenes.make_arm()
    expected = scenes.modifier_shapes(obj, [8], True)
    bpy.context.scene.frame_set(1)
    walk_sides.key(obj, 'modifiers["Armature"].show_viewport', [(1, 0.0), (8, 1.0)])
    scenes.add_sinew(obj, "dq")
    scenes.shapes(obj, [6, 8])
    walk_sides.remove_curves(obj, "")
    got = scenes.shapes(obj, [8])
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_keys_of_visibility_on_a_hidden_object():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    obj.hide_viewport = True
    bpy.context.view_layer.update()
    obj.modifiers["Armature"].keyframe_insert("show_viewport", frame=3)
    bpy.context.scene.frame_set(4)
    properties.of(obj).enabled = False
    obj.animation_data_clear()
    assert obj.modifiers["Armature"].show_viewport


@pytest.mark.by_sinew
def test_the_error_of_a_deleted_modifier_stays():
    obj, _armature = scenes.make_arm()
    scenes.add_sinew(obj)
    obj.modifiers.remove(obj.modifiers["Armature"])
    for frame in (3, 4):
        bpy.context.scene.frame_set(frame)
        obj.update_tag()
        bpy.context.view_layer.update()
        assert "Armature modifier was deleted" in properties.of(obj).error


def test_a_render_of_a_hidden_mesh_has_its_weights_and_its_keyed_method(rendered_points):
    obj, _armature = scenes.make_arm()
    settings = properties.of(obj)
    scenes.add_sinew(obj, "dq")
    for frame in (5, 11):
        settings.keyframe_insert("method", frame=frame)
    settings.method = "lbs"
    obj.hide_viewport = True
    bpy.context.view_layer.update()
    obj.vertex_groups[1].add(list(range(60, 140)), 0.3, "REPLACE")
    bpy.context.scene.frame_set(9)
    got = rendered_points(obj)
    obj.animation_data_clear()
    settings.method = "dq"
    assert scenes.worst(got, rendered_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)
    settings.method = "lbs"
    assert scenes.worst(got, rendered_points(obj)) > 0.01


@pytest.mark.usefixtures("route")
def test_visibility_that_is_keyed_while_sinew_is_on():
    obj, armature = scenes.make_arm()
    scenes.forget_keys(armature)
    scenes.add_sinew(obj)
    modifier = obj.modifiers["Armature"]
    for path in ("show_viewport", "show_render"):
        for frame in (2, 3):
            modifier.keyframe_insert(path, frame=frame)
    for curve in animation_paths.curves_of(obj):
        if ".show_" in curve.data_path:
            curve.keyframe_points[0].co.y = 0.0
    bpy.context.scene.frame_set(1)
    scenes.bend(armature, 90.0)
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) <= 1e-6
