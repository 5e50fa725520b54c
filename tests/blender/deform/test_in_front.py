# SPDX-License-Identifier: GPL-3.0-or-later
"""Modifiers, parents and shape keys that change the mesh before the Armature modifier."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import routes
import scenes
from bpy.app.handlers import persistent
from sinew_addon.attach import attach, properties
from sinew_addon.base.errors import SinewError
from sinew_addon.io import mesh_compare, mesh_io
from test_against_armature_modifier import assert_equal_to_modifier

pytestmark = pytest.mark.both_ways

FRAMES = [1, 4, 8, 11]


def deforming_parent(obj, armature):
    obj.parent, obj.parent_type = armature, "ARMATURE"


def lattice_in_front(obj, _armature):
    """Next to Blender's edge cases: a lattice that moves the mesh, and a mask that mixes the two inputs."""
    modifier = scenes.put_in_front(obj, "LATTICE", "Lattice")
    modifier.object = scenes.added("Lattice", bpy.data.lattices.new("Lattice"))
    modifier.object.scale = (5.0, 1.0, 1.0)
    modifier.object.data.points[0].co_deform.y += 0.5
    obj.modifiers["Armature"].vertex_group = obj.vertex_groups.new(name="mask").name
    obj.vertex_groups["mask"].add(range(len(obj.data.vertices)), 0.5, "REPLACE")


@pytest.mark.parametrize("make", [deforming_parent, lattice_in_front])
def test_a_multi_modifier_over_unread_input_is_refused(make):
    obj, armature = scenes.make_arm()
    make(obj, armature)
    modifier = obj.modifiers["Armature"]
    modifier.use_multi_modifier = True
    expected = scenes.shapes(obj, FRAMES)
    with pytest.raises(SinewError, match="is a Multi Modifier"):
        attach.add(obj, "lbs")
    modifier.use_multi_modifier = False
    scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(4)
    assert not properties.of(obj).error
    modifier.use_multi_modifier = True
    bpy.context.scene.frame_set(5)
    bpy.context.view_layer.update()
    assert "is a Multi Modifier" in properties.of(obj).error
    assert modifier.show_viewport
    # What Sinew leaves in the stack while it is off stands behind what Blender mixes.
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    attach.remove(obj)
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_mirrored_groups_take_the_other_side():
    obj, armature = scenes.make_arm(bones=2)
    for index, side in enumerate("LR"):
        armature.data.bones[index].name = f"bone.{side}"
    scenes.put_in_front(obj, "MIRROR", "Mirror")
    assert_equal_to_modifier(obj, FRAMES)


def test_a_lattice_in_front_follows_both_objects():
    obj, _armature = scenes.make_arm(bones=3)
    modifier = scenes.put_in_front(obj, "LATTICE")
    lattice = scenes.added("Lattice", bpy.data.lattices.new("Lattice"))
    lattice.scale = (4.0, 4.0, 4.0)
    lattice.data.points[0].co_deform.x -= 0.4
    modifier.object = lattice
    for moving in (lattice, obj):
        scenes.key(moving, "location", ((1, (0.0, 0.0, 0.0)), (11, (0.0, 0.3, 0.0))))
    assert_equal_to_modifier(obj, FRAMES)


def test_number_of_vertices_that_changes_in_front():
    obj, _armature = scenes.make_arm(bones=3)
    build = scenes.put_in_front(obj, "BUILD")
    build.frame_start, build.frame_duration = 1, 12
    expected = [scenes.shapes(obj, [frame])[0] for frame in (2, 5, 8)]
    scenes.add_sinew(obj)
    for frame, shape in zip((2, 5, 8), expected, strict=True):
        got = scenes.shapes(obj, [frame])[0]
        assert got.shape == shape.shape
        assert scenes.worst(got, shape) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_proxy_at_the_address_of_a_deleted_object(route):
    """Blender finds evaluated objects by the addresses of their originals: it would return the other's."""
    obj, _armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(8)
    mesh = bpy.data.meshes.new_from_object(obj)
    others: list[bpy.types.Object] = []

    def delete(_scene, _depsgraph):
        while others:
            bpy.data.objects.remove(others.pop())

    # Which of the addresses that are free a new object gets is up to the system's allocator.
    for _attempt in range(20):
        others += [scenes.added("Other", mesh) for _each in range(50)]
        bpy.context.view_layer.update()
        addresses = {other.as_pointer() for other in others}
        # Like another add-on's handler, before Sinew's.
        with scenes.handler("depsgraph_update_post", delete, first=True):
            front = scenes.put_in_front(obj)
            bpy.context.view_layer.update()
        if properties.of(obj).storage.upstream_proxy.as_pointer() in addresses:
            break
        obj.modifiers.remove(front)
        bpy.context.view_layer.update()
    else:
        pytest.fail("nothing is tested")
    scenes.assert_as_without(obj)


@pytest.mark.parametrize("kind", ["CLOTH", "PARTICLE_SYSTEM", "SOFT_BODY"])
def test_a_simulation_behind_a_parent_that_deforms(kind):
    obj, armature = scenes.make_arm()
    scenes.deform_by_parent(obj, armature)
    obj.modifiers.new("Behind", kind)
    expected = scenes.shapes(obj, FRAMES)
    if kind == "SOFT_BODY":
        with pytest.raises(SinewError, match="in front of Behind Blender permits only"):
            attach.add(obj, "lbs")
    else:
        scenes.add_sinew(obj, "lbs")
        assert properties.has_sinew(obj)
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_one_view_layer_has_it_for_its_position_alone():
    obj, _armature = scenes.make_arm()
    mask = scenes.put_in_front(obj, "MASK", "Mask")
    mask.vertex_group, mask.invert_vertex_group, mask.threshold = "bone.0", True, 0.5
    collection = bpy.data.collections.new("Its own")
    bpy.context.scene.collection.children.link(collection)
    scenes.move_to(collection, obj)
    follower = scenes.added("Follower", None)
    follower.constraints.new("COPY_TRANSFORMS").target = obj
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(8)
    bpy.context.view_layer.layer_collection.children["Its own"].exclude = True
    bpy.context.view_layer.update()
    bpy.context.window.view_layer = bpy.context.scene.view_layers.new("Second")
    got = scenes.final_points(obj)
    assert not properties.of(obj).error
    attach.remove(obj)
    expected = scenes.final_points(obj)
    assert scenes.worst(expected, scenes.rest_points(obj)[-len(expected) :]) > 0.05
    assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("event", ["frame_change_pre", "frame_change_post"])
def test_a_mesh_that_another_addon_moves_with_each_frame(event, route):
    if event == "frame_change_post" and route == routes.UPDATE:
        pytest.skip("what handlers change behind Sinew's is shown with the next event")
    obj, _armature = scenes.make_arm(bones=3)
    scenes.put_in_front(obj, "MIRROR").use_axis = (False, True, False)
    rest = np.array([vertex.co for vertex in obj.data.vertices])

    @persistent
    def move(scene, _depsgraph=None):
        obj.data.attributes["position"].data.foreach_set(
            "vector", (rest + 0.02 * scene.frame_current).ravel()
        )
        obj.data.update_tag()

    scenes.add_sinew(obj, "lbs")
    getattr(bpy.app.handlers, event).append(move)
    shown = scenes.shapes(obj, FRAMES)
    proxy = properties.of(obj).storage.upstream_proxy
    assert (proxy.data == obj.data) == (route == routes.UPDATE)
    properties.of(obj).enabled = False
    expected = scenes.shapes(obj, FRAMES)
    getattr(bpy.app.handlers, event).remove(move)
    assert scenes.worst(shown, expected) <= 1e-5


@pytest.mark.parametrize("kind", ["MIRROR", "SIMPLE_DEFORM"])
def test_an_edit_is_compared_once(kind, monkeypatch, route):
    """Comparing two meshes takes longest."""
    obj, _armature = scenes.make_arm(bones=3)
    scenes.put_in_front(obj, kind)
    scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(8)
    alike, compared = mesh_compare.are_alike, []
    monkeypatch.setattr(mesh_compare, "are_alike", lambda *pair: compared.append(pair) or alike(*pair))

    def edit_weights():
        obj.vertex_groups["bone.1"].add(range(0, len(obj.data.vertices), 3), 0.1, "ADD")

    def edit_points():
        obj.data.vertices[0].co.y += 0.1
        obj.data.update()

    for edit in (edit_weights, edit_weights, edit_points, edit_weights):
        compared.clear()
        edit()
        bpy.context.view_layer.update()
        assert len(compared) == 1
    monkeypatch.undo()
    scenes.assert_as_without(obj)


@pytest.mark.parametrize("event", ["depsgraph_update_pre", "depsgraph_update_post"])
def test_a_mesh_that_another_addon_edits_while_its_copy_is_made(event):
    obj, _armature = scenes.make_arm(bones=3)
    scenes.put_in_front(obj, "SIMPLE_DEFORM")
    scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(8)
    before = properties.of(obj).storage.upstream_proxy
    edits = []

    @persistent
    def edit(_scene, _depsgraph):
        # The evaluation of the copy that was just made.
        if not edits and properties.of(obj).storage.upstream_proxy != before:
            edits.append(obj.vertex_groups["bone.1"].add(range(0, 60), 0.3, "ADD"))
            obj.data.update_tag()

    with scenes.handler(event, edit, first=True):
        obj.data.vertices[0].co.y += 0.1
        obj.data.update()
        bpy.context.view_layer.update()
    assert edits
    bpy.context.view_layer.update()
    scenes.assert_as_without(obj)


def test_weights_that_are_no_numbers_equal_those_of_the_copy():
    """Sinew would copy the mesh again and again."""
    obj, _armature = scenes.make_arm(bones=3)
    obj.vertex_groups["bone.1"].add([3], float("nan"), "REPLACE")
    assert np.isnan(mesh_io.read_group_weights(obj.data).weights).any()
    scenes.put_in_front(obj, "MIRROR")
    scenes.add_sinew(obj, "lbs")
    copy = properties.of(obj).storage.upstream_proxy
    obj.data.update_tag()
    bpy.context.view_layer.update()
    assert properties.of(obj).storage.upstream_proxy == copy


def test_weights_are_painted_on_the_shared_mesh():
    """A copy would be made again with each stroke."""
    obj, _armature = scenes.make_arm(bones=3)
    scenes.put_in_front(obj, "MIRROR")
    scenes.add_sinew(obj, "lbs")
    bpy.context.view_layer.update()
    for mode, users in (("WEIGHT_PAINT", 2), ("OBJECT", 1)):
        bpy.ops.object.mode_set(mode=mode)
        bpy.context.view_layer.update()
        assert obj.data.users == users


def reads_rest_position(obj):
    """Nodes in front that move each vertex by its rest position."""

    def make(group, source):
        named = group.nodes.new("GeometryNodeInputNamedAttribute")
        named.data_type, named.inputs["Name"].default_value = "FLOAT_VECTOR", "rest_position"
        move = group.nodes.new("GeometryNodeSetPosition")
        group.links.new(named.outputs[0], move.inputs["Offset"])
        group.links.new(source.outputs[0], move.inputs["Geometry"])
        return move.outputs[0]

    scenes.put_in_front(obj, "NODES").node_group = scenes.nodes(make)


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("is_keyed", [False, True])
def test_rest_position_that_the_artist_adds(is_keyed):
    obj, _armature = scenes.make_arm()
    if is_keyed:
        scenes.key_shape(obj)
    reads_rest_position(obj)
    expected = {}
    for is_added in (True, False):
        obj.add_rest_position_attribute = is_added
        expected[is_added] = scenes.shapes(obj, FRAMES)
    assert scenes.worst(expected[True], expected[False]) > 0.1, "nothing is tested"
    obj.add_rest_position_attribute = True
    scenes.add_sinew(obj)
    for is_added in (True, False):
        obj.add_rest_position_attribute = is_added
        got = scenes.shapes(obj, FRAMES)
        assert scenes.worst(got, expected[is_added]) <= scenes.TOLERANCE * scenes.diagonal(obj), is_added


def test_clicks_in_the_list_of_shape_keys_make_no_proxy():
    obj, _armature = scenes.make_arm()
    scenes.put_in_front(obj)
    scenes.key_shape(obj)
    scenes.add_sinew(obj)
    bpy.context.scene.frame_set(5)
    proxy = properties.of(obj).storage.upstream_proxy.session_uid
    for index in (1, 0, 1):
        obj.active_shape_key_index = index
        bpy.context.view_layer.update()
    assert properties.of(obj).storage.upstream_proxy.session_uid == proxy
    obj.show_only_shape_key = True
    for index in (1, 0):
        obj.active_shape_key_index = index
        bpy.context.view_layer.update()
        shown = scenes.final_points(obj)
        properties.of(obj).enabled = False
        assert scenes.worst(shown, scenes.final_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)
        properties.of(obj).enabled = True


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("front", [None, "SUBSURF"])
@pytest.mark.parametrize("group", ["", "bone.1", "missing"])
@pytest.mark.parametrize("is_muted", [False, True])
def test_a_pinned_shape_key_is_masked_by_its_group(front, group, is_muted):
    obj, _armature = scenes.make_arm()
    if front is not None:
        scenes.put_in_front(obj, front)
    scenes.key_shape(obj)
    second = obj.shape_key_add(name="Second", from_mix=False)
    for point in second.data:
        point.co.y *= 2.0
    second.relative_key, second.vertex_group, second.mute = obj.data.shape_keys.key_blocks[1], group, is_muted
    obj.active_shape_key_index, obj.show_only_shape_key = 2, True
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj)
    assert scenes.worst(scenes.shapes(obj, FRAMES), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
