# SPDX-License-Identifier: GPL-3.0-or-later
"""Generated texture coordinates, which procedural textures use by default, are those of the rest shape, as
with the Armature modifier; and what Sinew needs for it comes and goes with it."""

import shutil

import bpy
import numpy as np
import pytest
import routes
import scenes
from sinew_addon.attach import attach, node_group, properties, stack


@pytest.fixture
def rendered(rendered_points):
    """rendered(object): its shape, its undeformed shape and its attributes, as renderers get them."""

    def render(obj):
        bpy.context.scene.frame_set(9)
        shape = rendered_points(obj)
        return shape, scenes.KeepingEngine.undeformed[obj.name], scenes.KeepingEngine.attributes[obj.name]

    return render


def _assert_same(got, expected):
    shape, rest, _names = got
    assert scenes.worst(shape, expected[0]) <= 1e-5
    np.testing.assert_array_equal(rest, expected[1])


def _with_keys(obj):
    for _each in range(2):
        obj.shape_key_add()
    obj.data.shape_keys.key_blocks[1].data[3].co.z += 0.5
    obj.data.shape_keys.key_blocks[1].value = 1.0


def _by_envelopes(obj):
    obj.vertex_groups.clear()
    obj.modifiers["Armature"].use_bone_envelopes = True


def _shared(obj):
    scenes.added("Other", obj.data)


CHARACTERS = {
    "plain": lambda obj: None,
    "shape keys": _with_keys,
    "Subdivision behind": lambda obj: obj.modifiers.new("Behind", "SUBSURF"),
    "Solidify behind": lambda obj: obj.modifiers.new("Behind", "SOLIDIFY"),
    "Cast behind": lambda obj: obj.modifiers.new("Behind", "CAST"),
    "Subdivision in front": scenes.put_in_front,
    "Cast in front": lambda obj: scenes.put_in_front(obj, "CAST"),
    "shared mesh": _shared,
    "no vertex groups": _by_envelopes,
    "Add Rest Position": lambda obj: setattr(obj, "add_rest_position_attribute", True),
}


@pytest.mark.parametrize("name", CHARACTERS)
def test_coordinates_are_those_with_the_armature_modifier(rendered, route, name):
    obj, _armature = scenes.make_arm()
    CHARACTERS[name](obj)
    expected = rendered(obj)
    before = [modifier.name for modifier in obj.modifiers], obj.add_rest_position_attribute
    scenes.add_sinew(obj, "lbs")
    _assert_same(rendered(obj), expected)
    assert set(rendered(obj)[2]) == set(expected[2])
    properties.of(obj).enabled = False
    _assert_same(rendered(obj), expected)
    assert obj.add_rest_position_attribute == before[1]
    properties.of(obj).enabled = True
    _assert_same(rendered(obj), expected)
    attach.remove(obj)
    assert ([modifier.name for modifier in obj.modifiers], obj.add_rest_position_attribute) == before
    _assert_same(rendered(obj), expected)


@pytest.mark.parametrize("kind", ["SKIN", "REMESH", "SCREW", "NODES"])
def test_modifiers_in_front_that_make_another_mesh(rendered, kind):
    """It has no mark, so it has to be deformed."""
    # Skin takes two seconds for each evaluation of the usual one.
    obj, _armature = scenes.make_arm(sides=6, rings=9)
    if kind != "SKIN":
        obj.modifiers["Armature"].use_bone_envelopes = True
    modifier = scenes.put_in_front(obj, kind)
    if kind == "NODES":
        modifier.node_group = scenes.nodes(
            lambda group, _source: node_group.add(group, "GeometryNodeMeshCone")
        )
    expected = rendered(obj)[0], scenes.final_points(obj)
    assert scenes.worst(expected[1], scenes.shapes(obj, [1])[0]) > 0.05
    scenes.add_sinew(obj, "lbs")
    got = rendered(obj)[0], scenes.final_points(obj)
    assert max(map(scenes.worst, got, expected)) <= 1e-5


def _remove(group, source, name="rest_position"):
    inputs = {"Geometry": source, "Name": name}
    return node_group.add(group, "GeometryNodeRemoveAttribute", inputs)


def _remove_by_pattern(group, source):
    node = _remove(group, source, "rest*")
    if hasattr(node, "pattern_mode"):  # before Blender 5.0
        node.pattern_mode = "WILDCARD"
    else:
        node.inputs["Pattern Mode"].default_value = "Wildcard"
    return node


def _of_another_object(group, _source):
    """With its vertex groups in another order."""
    (obj,) = (each for each in bpy.data.objects if each.type == "MESH")
    other = scenes.copied(obj, "Other")
    other.modifiers.clear()
    for vertex in other.data.vertices:
        vertex.co.z *= 1.3
    other.vertex_groups.active_index = 0
    with bpy.context.temp_override(object=other):
        bpy.ops.object.vertex_group_move(direction="DOWN")
    assert other.vertex_groups.keys() != obj.vertex_groups.keys()
    return node_group.add(group, "GeometryNodeObjectInfo", {"Object": other}).outputs["Geometry"]


@pytest.mark.parametrize("make", [_remove, _remove_by_pattern, _of_another_object])
def test_node_groups_in_front_that_lose_the_mark(rendered, route, make):
    """Also where the artist changes the group while Sinew is on."""
    obj, _armature = scenes.make_arm(bones=3)
    mask = obj.vertex_groups.new(name="Mask")
    mask.add(range(len(obj.data.vertices)), 0.7, "REPLACE")
    obj.modifiers["Armature"].vertex_group = mask.name
    trees = [scenes.nodes(make), scenes.nodes(lambda group, source: source)]

    def nested(group, source):
        return node_group.add(group, "GeometryNodeGroup", {0: source}, node_tree=trees[0])

    outer = scenes.nodes(nested)
    scenes.put_in_front(obj, "NODES").node_group = outer

    def shapes(tree):
        outer.nodes["Group"].node_tree = tree
        bpy.context.view_layer.update()
        return rendered(obj)[0], scenes.final_points(obj)

    expected = [shapes(tree) for tree in trees]
    for number in (1, 0, 1, 0):
        got = shapes(trees[number])
        assert max(map(scenes.worst, got, expected[number])) <= 1e-5
        if stack.sinew_modifier(obj) is not None:
            routes.taken(obj, 0)
        else:
            scenes.add_sinew(obj, "lbs")


# Blender applies no modifier of the others, as their meshes have two users.
@pytest.mark.parametrize("name", [n for n in CHARACTERS if n != "shared mesh" and "in front" not in n])
@pytest.mark.parametrize("is_hidden", [False, True])
def test_applying_the_modifier_keeps_the_shape(name, is_hidden):
    """Blender evaluates it alone then. Where that gives rest points, as for a hidden object, the Armature
    modifier deforms again."""
    obj, _armature = scenes.make_arm()
    CHARACTERS[name](obj)
    if obj.data.shape_keys is not None:
        obj.shape_key_clear()
    scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(9)
    shape = scenes.final_points(obj)
    obj.hide_viewport = is_hidden
    bpy.ops.object.modifier_apply(modifier=stack.sinew_modifier(obj).name)
    obj.hide_viewport = False
    assert scenes.worst(scenes.final_points(obj), shape) <= 1e-5
    assert (stack.armature_modifier(obj) is None) == (not is_hidden)
    assert not any("sinew" in name for name in obj.data.attributes.keys())  # noqa: SIM118


def test_the_mark_that_somebody_applied_is_made_again(rendered):
    obj, _armature = scenes.make_arm()
    expected = rendered(obj)
    scenes.add_sinew(obj, "lbs")
    bpy.ops.object.modifier_apply(modifier=scenes.mark(obj).name)
    _assert_same(rendered(obj), expected)
    assert scenes.mark(obj) is not None
    assert node_group.IN_STACK not in obj.data.attributes


def test_the_artists_own_attribute_of_that_name_stays(rendered):
    obj, _armature = scenes.make_arm()
    obj.data.attributes.new("rest_position", "FLOAT_VECTOR", "POINT").data[5].vector = (1, 2, 3)
    expected = rendered(obj)
    scenes.add_sinew(obj, "lbs")
    shape, _rest, names = rendered(obj)
    assert scenes.worst(shape, expected[0]) <= 1e-5
    assert "rest_position" in names
    assert not obj.add_rest_position_attribute


def test_what_marks_the_mesh_changes_while_sinew_is_on(route):
    """Add Rest Position is switched off, then the mesh gets an attribute of that name."""
    obj, _armature = scenes.make_arm()
    bpy.context.scene.frame_set(9)
    expected = scenes.final_points(obj)
    scenes.add_sinew(obj, "lbs")
    obj.add_rest_position_attribute = False
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), expected) <= 1e-5
    obj.data.attributes.new("rest_position", "FLOAT_VECTOR", "POINT")
    obj.data.update()
    bpy.context.view_layer.update()
    obj.sinew.method = "lbs"
    assert not obj.add_rest_position_attribute
    assert scenes.worst(scenes.final_points(obj), expected) <= 1e-5


def test_the_modifier_is_made_again_and_follows(rendered):
    obj, _armature = scenes.make_arm()
    expected = rendered(obj)
    scenes.add_sinew(obj, "lbs")
    obj.modifiers.remove(scenes.neutral(obj))
    _assert_same(rendered(obj), expected)
    obj.modifiers.remove(scenes.mark(obj))
    _assert_same(rendered(obj), expected)
    mark, neutral = scenes.mark(obj), scenes.neutral(obj)
    mark.name, neutral.name = "First", "Renamed"
    behind = obj.modifiers.new("Behind", "CAST")
    behind.show_viewport = behind.show_render = False
    obj.modifiers.move(list(obj.modifiers).index(neutral), len(obj.modifiers) - 1)
    obj.modifiers.move(list(obj.modifiers).index(mark), 0)
    _assert_same(rendered(obj), expected)
    assert [m.name for m in obj.modifiers] == ["Armature", "First", "Sinew", "Renamed", "Behind"]
    attach.remove(obj)
    assert [m.type for m in obj.modifiers] == ["ARMATURE", "CAST"]


def test_add_rest_position_that_the_artist_switches_meanwhile(rendered):
    obj, _armature = scenes.make_arm()
    obj.add_rest_position_attribute = True
    expected = rendered(obj)
    scenes.add_sinew(obj, "lbs")
    obj.add_rest_position_attribute = False
    bpy.context.view_layer.update()
    _assert_same(rendered(obj), expected)
    attach.remove(obj)
    assert not obj.add_rest_position_attribute


def test_a_saved_file_is_as_without_sinew(rendered, tmp_path):
    obj, _armature = scenes.make_arm()
    expected = rendered(obj)
    scenes.add_sinew(obj, "lbs")
    rendered(obj)
    path, copy = str(tmp_path / "saved.blend"), str(tmp_path / "copy.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    shutil.copy(path, copy)
    assert obj.add_rest_position_attribute
    with bpy.data.libraries.load(copy) as (_names, loaded):
        loaded.objects = [obj.name]
    (saved,) = loaded.objects
    assert not saved.add_rest_position_attribute
    assert [m.show_viewport or m.show_render for m in saved.modifiers] == [True, False, False, False]
    bpy.ops.wm.open_mainfile(filepath=path)
    _assert_same(rendered(bpy.data.objects["Arm"]), expected)


def test_it_is_said_where_a_click_on_a_helping_modifier_is_taken_back(tmp_path):
    obj, _armature = scenes.skinned_arm("dq")
    nodes = stack.sinew_modifier(obj)
    # Clicks on Sinew's own icon and on its switch are none on theirs.
    for act in (
        lambda: setattr(nodes, "show_viewport", False),
        lambda: bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "arm.blend")),
        lambda: setattr(nodes, "show_viewport", True),
        lambda: setattr(obj.sinew, "enabled", False),
        lambda: setattr(obj.sinew, "enabled", True),
    ):
        act()
        bpy.context.view_layer.update()
        bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)
        assert attach.notes(obj) == []
    for modifier in stack.helping_modifiers(obj):
        modifier.show_viewport = False
    bpy.context.view_layer.update()
    assert all(modifier.show_viewport for modifier in stack.helping_modifiers(obj))
    assert "switch the modifier Sinew" in attach.notes(obj)[0]
