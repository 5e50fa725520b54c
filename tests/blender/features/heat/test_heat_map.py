# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map: its colours are those of the measure, they follow frame and pose, and nothing remains of
it."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import test_linked_data
import test_shown_colours
import whole_file
from sinew_addon.attach import attach, properties
from sinew_addon.deform import characters, session
from sinew_addon.features.heat import heat_legend, heat_map, heat_nodes, measures
from sinew_addon.features.measure import live, subjects
from sinew_addon.features.measure.heat_scale import HeatScale, linear
from sinew_addon.features.measure.metrics import METRICS

pytestmark = pytest.mark.long_term


def shown_colours(obj: bpy.types.Object) -> np.ndarray:
    """float32 [vertices, 3], linear, of the final evaluated mesh."""
    mesh = scenes.evaluated(obj).data
    attribute = mesh.attributes[heat_nodes.NAME]
    assert (attribute.data_type, attribute.domain) == ("FLOAT_COLOR", "POINT")
    colours = np.empty(4 * len(mesh.vertices), dtype=np.float32)
    attribute.data.foreach_get("color", colours)
    return colours.reshape(-1, 4)[:, :3]


def expected_fields(objects: list[bpy.types.Object], methods: tuple[str, str], frame: float) -> dict:
    """Each measure at each vertex of all objects, from Blender's own evaluations, independently of how
    the heat map is made. Changes the methods."""
    scene = bpy.context.scene
    subject = subjects.gather(scene, objects)
    shapes = subjects.shapes_at(subject, methods, frame)
    measured = subject.gauge.measure(*(shapes[method] for method in methods))
    return {name: measured.field(name) for name in METRICS} | {"diagonal": subject.gauge.rest.diagonal}


def choose(quantity: str, **settings: object) -> measures.SinewMeasures:
    chosen = measures.of(bpy.context.scene)
    chosen.quantity = quantity
    for name, value in settings.items():
        setattr(chosen, name, value)
    return chosen


def placed(obj: bpy.types.Object) -> None:
    obj.location, obj.scale = (0.5, 0.2, 0.0), (1.5, 1.5, 1.5)
    armature = obj.modifiers["Armature"].object
    armature.location, armature.rotation_euler = (1.0, -2.0, 0.3), (0.2, 0.1, 0.7)


@pytest.mark.parametrize("quantity", METRICS)
@pytest.mark.parametrize("set_up", [None, scenes.put_in_front, scenes.key_shape, placed])
def test_colours_are_those_of_the_measure(quantity, set_up):
    obj, armature = scenes.make_arm()
    if set_up is not None:
        set_up(obj)
    # Bent so far that linear blend flips faces.
    scenes.key_pose(armature, 170.0)
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    scenes.add_sinew(obj, "lbs")
    bpy.context.scene.frame_set(11)
    expected = expected_fields([obj], ("lbs", "blender"), 11)
    characters.use_method(obj, "lbs")
    choose(quantity)
    bpy.ops.sinew.heat_map()
    values = expected[quantity]
    assert np.ptp(values) > 0.02, "nothing is tested"
    scale = HeatScale.over_values(METRICS[quantity], values.min(), values.max(), expected["diagonal"])
    np.testing.assert_allclose(shown_colours(obj), linear(scale.colours(values)), atol=3e-3)


def test_the_modifier_compared_with_is_blenders():
    """With Preserve Volume the modifier equals dq, and so does Sinew: the distance is 0."""
    obj, _armature = scenes.make_arm()
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(11)
    assert scenes.measure(obj).measured.entry("distance_max") < 1e-5
    assert scenes.measure(obj, "lbs").measured.entry("distance_max") > 0.02


def test_colours_follow_frames_poses_and_methods():
    obj, armature = scenes.skinned_arm("lbs")
    choose("stretch", range=measures.FIXED, ratio=2.0)
    bpy.ops.sinew.heat_map()
    seen = []
    for frame in (1, 6, 11):
        bpy.context.scene.frame_set(frame)
        seen.append(shown_colours(obj))
        evaluate_expected = expected_at(obj, "lbs")
        np.testing.assert_allclose(seen[-1], evaluate_expected, atol=3e-3)
    assert np.ptp(seen[0], axis=0).max() < 1e-3
    assert np.abs(seen[1] - seen[0]).max() > 0.05
    assert np.abs(seen[2] - seen[1]).max() > 0.05
    scenes.forget_keys(armature)
    scenes.bend(armature, 120.0)
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()
    posed = shown_colours(obj)
    np.testing.assert_allclose(posed, expected_at(obj, "lbs"), atol=3e-3)
    assert np.abs(posed - seen[2]).max() > 0.05
    properties.of(obj).method = "dq"
    np.testing.assert_allclose(shown_colours(obj), expected_at(obj, "dq"), atol=3e-3)
    assert np.abs(shown_colours(obj) - posed).max() > 0.05


def expected_at(obj: bpy.types.Object, method: str) -> np.ndarray:
    """For the current pose, from the final points; with a fixed range up to 2."""
    assert properties.of(obj).method == method
    points, rest = (p.astype(np.float64) for p in (scenes.final_points(obj), scenes.rest_points(obj)))
    longest, shortest = np.ones((2, len(points)))
    for edge in obj.data.edges:
        a, b = edge.vertices
        ratio = np.linalg.norm(points[a] - points[b]) / np.linalg.norm(rest[a] - rest[b])
        for vertex in (a, b):
            longest[vertex], shortest[vertex] = max(longest[vertex], ratio), min(shortest[vertex], ratio)
    values = np.where(longest * shortest >= 1.0, longest, shortest)
    return linear(HeatScale.fixed(METRICS["stretch"], 2.0, 1.0, 1.0).colours(values))


@pytest.mark.parametrize("quantity", ["stretch", "bulge", "distance"])
def test_what_is_not_finite_has_the_colour_of_the_worst(quantity):
    scale = HeatScale.fixed(METRICS[quantity], 2.0, 1.0, 1.0)
    values = np.array([np.nan, np.inf, 1e9])
    for colours in (scale.colours(values), scale.linear_colours(values)):
        assert np.array_equal(colours[0], colours[2])
        assert np.array_equal(colours[1], colours[2])


def test_two_objects_of_one_mesh_have_colours_of_their_own_and_one_range():
    first, armature = scenes.make_arm()
    second = scenes.copied(first, "Twin", linked=True)
    rig = scenes.copied(armature, linked=True)
    second.modifiers["Armature"].object = rig
    rig.animation_data_clear()
    for bone in rig.pose.bones:
        bone.matrix_basis.identity()
    second.select_set(True)
    bpy.context.scene.frame_set(11)
    bpy.ops.sinew.add()
    choose("bulge")
    bpy.ops.sinew.heat_map()
    assert properties.of(first).storage.point_buffer != properties.of(second).storage.point_buffer
    bent, straight = shown_colours(first), shown_colours(second)
    assert np.ptp(bent, axis=0).max() > 0.1
    assert np.ptp(straight, axis=0).max() < 1e-3
    expected = expected_fields([first, second], ("lbs", "blender"), 11)
    bulge = expected["bulge"]
    scale = HeatScale.over_values(METRICS["bulge"], bulge.min(), bulge.max(), expected["diagonal"])
    np.testing.assert_allclose(np.concatenate([bent, straight]), linear(scale.colours(bulge)), atol=3e-3)


@pytest.mark.parametrize("set_up", [None, scenes.put_in_front])
def test_scenes_have_ranges_of_their_own(set_up):
    first, bent = scenes.make_arm()
    scenes.key_pose(bent, 160.0)
    if set_up is not None:
        set_up(first)
    scenes.add_sinew(first, "dq")
    choose("bulge")
    bpy.context.scene.frame_set(11)
    bpy.ops.sinew.heat_map()
    before = shown_colours(first)
    one, two = bpy.context.scene, bpy.data.scenes.new("Two")
    bpy.context.window.scene = two
    second, _armature = scenes.skinned_arm("lbs", name="Second")
    choose("bulge")
    two.frame_set(5)
    bpy.ops.sinew.heat_map()
    assert heat_legend.contents.keys() == {one.session_uid, two.session_uid}
    shown = shown_colours(second)
    expected = expected_fields([second], ("lbs", "blender"), 5)
    bulge = expected["bulge"]
    scale = HeatScale.over_values(METRICS["bulge"], bulge.min(), bulge.max(), expected["diagonal"])
    np.testing.assert_allclose(shown, linear(scale.colours(bulge)), atol=3e-3)
    bpy.context.window.scene = one
    bpy.context.view_layer.update()
    np.testing.assert_allclose(shown_colours(first), before, atol=1e-6)


def painted_arm() -> bpy.types.Object:
    """With the artist's own material and colours."""
    obj = test_shown_colours.painted_arm("Arm")
    obj.data.materials.append(bpy.data.materials.new("Skin"))
    for attribute in obj.data.color_attributes:
        attribute.data.foreach_set("color", np.linspace(0.0, 1.0, 4 * len(attribute.data), dtype=np.float32))
    return obj


@pytest.mark.parametrize("set_up", [None, scenes.put_in_front, scenes.key_shape])
def test_switched_off_it_leaves_no_trace(set_up):
    obj = painted_arm()
    if set_up is not None:
        set_up(obj)
    bpy.context.scene.frame_set(6)
    before_sinew = whole_file.content()
    types = test_shown_colours.color_types()
    scenes.add_sinew(obj, "dq")
    measures.of(bpy.context.scene)
    before = whole_file.content()
    bpy.ops.sinew.heat_map()
    mesh = scenes.evaluated(obj).data
    assert mesh.attributes.active_color_name == heat_nodes.NAME
    assert heat_nodes.NAME in [m.name for m in mesh.materials if m is not None]
    assert [slot.material.name for slot in obj.material_slots] == ["Skin"]
    assert set(test_shown_colours.color_types()) == {"VERTEX"}
    bpy.context.scene.frame_set(9)
    bpy.context.scene.frame_set(6)
    bpy.ops.sinew.heat_map()
    bpy.context.view_layer.update()
    assert test_shown_colours.color_types() == types
    whole_file.assert_same(before)
    # It also ends when Sinew is removed while it is on.
    bpy.ops.sinew.heat_map()
    choose("bulge", range=measures.FIXED, length=0.5)
    bpy.context.scene.sinew_most_influences = 2
    bpy.ops.sinew.remove()
    assert test_shown_colours.color_types() == types
    assert obj.data.attributes.active_color_name == "Second"
    whole_file.assert_same(before_sinew)


def test_while_sinew_is_off_views_are_as_they_were():
    obj, types = painted_arm(), test_shown_colours.color_types()
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(6)
    bpy.ops.sinew.heat_map()
    colours = shown_colours(obj)
    properties.of(obj).enabled = False
    assert test_shown_colours.color_types() == types
    assert obj.data.attributes.active_color_name == "Second"
    properties.of(obj).enabled = True
    assert set(test_shown_colours.color_types()) == {"VERTEX"}
    np.testing.assert_allclose(shown_colours(obj), colours, atol=1e-6)


def test_converted_to_a_mesh_it_leaves_nothing_of_itself():
    obj, _armature = scenes.make_arm()
    obj.data.materials.append(bpy.data.materials.new("Skin"))
    scenes.add_sinew(obj, "dq")
    bpy.ops.sinew.heat_map()
    bpy.context.view_layer.update()
    with bpy.context.temp_override(active_object=obj, object=obj, selected_objects=[obj]):
        bpy.ops.object.convert(target="MESH")
    session.refresh(bpy.context)
    assert not properties.has_sinew(obj)
    assert heat_nodes.NAME not in obj.data.attributes
    assert [material.name for material in obj.data.materials] == ["Skin"]
    assert not [m for m in bpy.data.materials if m.get(heat_nodes.MARK)]


def test_a_duplicate_has_colours_of_its_own():
    obj, _armature = scenes.skinned_arm("dq")
    bpy.ops.sinew.heat_map()
    bpy.context.scene.frame_set(9)
    bpy.ops.object.duplicate(linked=True)
    twin = bpy.context.object
    assert twin != obj
    bpy.context.scene.frame_set(8)
    np.testing.assert_allclose(shown_colours(twin), shown_colours(obj), atol=1e-6)
    properties.of(twin).heat = False
    bpy.context.scene.frame_set(7)
    assert heat_nodes.NAME in scenes.evaluated(obj).data.attributes
    buffers = [properties.of(each).storage.point_buffer for each in (obj, twin)]
    assert [heat_nodes.COLOURS in point_buffer.data.attributes for point_buffer in buffers] == [True, False]


def test_colours_wait_for_a_point_buffer_that_is_empty():
    """As for the copy's own, until the copy is deformed."""
    obj, _armature = scenes.skinned_arm("dq")
    properties.of(obj).heat = True
    bpy.context.scene.frame_set(8)
    before = shown_colours(obj)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    pairs = session.deformed_now([obj], depsgraph)
    properties.of(obj).storage.point_buffer.data.clear_geometry()
    heat_map.update(pairs, depsgraph)
    scenes.rebind(obj)
    bpy.context.view_layer.update()
    assert np.array_equal(shown_colours(obj), before)


def test_a_render_shows_it(tmp_path):
    """Cycles, with a camera beside the tube: most of it has the neutral colour, none the red material."""
    obj, _armature = scenes.make_arm()
    red = bpy.data.materials.new("Red")
    if bpy.app.version < (5, 0):
        red.use_nodes = True
    red.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1.0, 0.0, 0.0, 1.0)
    obj.data.materials.append(red)
    scenes.add_sinew(obj, "lbs")
    choose("stretch", range=measures.FIXED, ratio=2.0)
    scene = bpy.context.scene
    scene.camera = scenes.added("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location, scene.camera.data.type = (0.5, 0.0, 5.0), "ORTHO"
    scene.camera.data.ortho_scale = 0.2
    scene.world = bpy.data.worlds.new("World")
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(tmp_path / "heat.png")
    scene.frame_set(1)
    bpy.ops.sinew.heat_map()
    bpy.ops.render.render(write_still=True)
    pixels = scenes.pixels_of(tmp_path / "heat.png", are_numbers=True)[:, :, :3]
    # At rest nothing is stretched: the middle of the map.
    middle = linear(HeatScale.fixed(METRICS["stretch"], 2.0, 1.0, 1.0).colours(np.ones(1)))[0]
    np.testing.assert_allclose(np.median(pixels, axis=(0, 1)), middle, atol=0.01)


def test_the_legend_says_range_unit_and_methods():
    _obj, _armature = scenes.skinned_arm("dq")
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    choose("distance", range=measures.FIXED, length=0.02)
    bpy.context.scene.frame_set(11)
    bpy.ops.sinew.heat_map()
    ((scale, title),) = heat_legend.contents.values()
    assert title == "Distance, Dual Quaternion against Armature modifier"
    assert heat_legend.labels(scale, scene)[0] == "0 m"
    assert heat_legend.labels(scale, scene)[-1] == "\u2265 2 cm"
    choose("stretch", ratio=4.0)
    assert heat_legend.labels(heat_legend.contents[scene.session_uid][0], scene)[::2] == [
        "0.25\u00d7",
        "1.00\u00d7",
        "4.00\u00d7",
    ]
    choose("flips")
    assert heat_legend.labels(heat_legend.contents[scene.session_uid][0], scene)[::4] == ["0 %", "100 %"]
    bpy.ops.sinew.heat_map()
    assert not heat_legend.contents


def test_off_it_measures_nothing(monkeypatch):
    obj, _armature = scenes.skinned_arm("dq")

    def fail(*_args: object) -> None:
        raise AssertionError("measured")

    monkeypatch.setattr(live, "measure", fail)
    for frame in (1, 5, 9):
        bpy.context.scene.frame_set(frame)
    assert not properties.of(obj).error
    assert measures.of(bpy.context.scene) is not None


@pytest.mark.parametrize("front", [False, True], ids=["alone", "front"])
@pytest.mark.parametrize("override", [False, True], ids=["local", "override"])
def test_linked_meshes_show_it_too(tmp_path, override, front):
    """With their material: a linked mesh keeps its active colour attribute."""
    test_linked_data.save_library(tmp_path, skinned=False, front=front)
    test_linked_data.link(tmp_path, override)
    obj = test_linked_data.character()
    scenes.add_sinew(obj, "dq")
    types = test_shown_colours.color_types()
    choose("stretch", range=measures.FIXED, ratio=2.0)
    properties.of(obj).heat = True
    bpy.context.scene.frame_set(11)
    colours = shown_colours(obj)
    assert np.ptp(colours, axis=0).max() > 0.05
    mesh = scenes.evaluated(obj).data
    assert heat_nodes.NAME in [m.name for m in mesh.materials if m is not None]
    path = str(tmp_path / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=True)
    np.testing.assert_allclose(shown_colours(test_linked_data.character()), colours, atol=1e-6)
    attach.remove(test_linked_data.character())
    assert test_shown_colours.color_types() == types
    assert not [m for m in bpy.data.materials if m.get(heat_nodes.MARK)]
    assert not [g for g in bpy.data.node_groups if g.get("sinew_node_group") and g.library is None]
