# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals that Sinew provides with the points: what is drawn, written and read is as with "Leave to
Blender"."""

from __future__ import annotations

import re

import bpy
import numpy as np
import pytest
import routes
import scenes
from sinew_addon.attach import node_group, normals, properties, stack
from sinew_addon.deform import session
from sinew_addon.features.pages.opengl import has_opengl
from sinew_addon.skinning.shading import Shading, SurfaceNormals
from sinew_addon.skinning.stage_mesh import Topology

LEAVE, GIVE = properties.LEAVE_NORMALS, properties.BY_SINEW
NEAR = 1e-6
COLLECTIONS = ("vertex_normals", "corner_normals")
needs_support = pytest.mark.skipif(
    not normals.ARE_SUPPORTED, reason="Blender takes no normals that are given"
)


pytestmark = pytest.mark.usefixtures("route")
# For what reads the evaluated mesh, whose normals test_normals_of_every_frame_are_blenders compares by both.
by_one_route_first = pytest.mark.parametrize(
    "route", [routes.EVALUATION, pytest.param(routes.UPDATE, marks=pytest.mark.slow)], indirect=True
)


def smooth(obj):
    obj.data.shade_smooth()


def sharp(obj):
    smooth(obj)
    obj.data.edges.foreach_set("use_edge_sharp", np.random.default_rng(1).random(len(obj.data.edges)) < 0.1)
    obj.data.update()


def partly_flat(obj):
    flags = np.random.default_rng(1).random(len(obj.data.polygons)) < 0.7
    obj.data.polygons.foreach_set("use_smooth", flags)
    obj.data.update()


def flat(obj):
    obj.data.shade_flat()


def custom(obj):
    sharp(obj)
    tilted = vectors(obj.data, "corner_normals")
    tilted = tilted + 0.3 * np.random.default_rng(2).normal(size=tilted.shape)
    obj.data.normals_split_custom_set((tilted / np.linalg.norm(tilted, axis=1, keepdims=True)).tolist())
    obj.data.update()


SHADINGS = (smooth, sharp, partly_flat, flat, custom)
DOMAINS = {smooth: "POINT", sharp: "CORNER", partly_flat: "CORNER", flat: "", custom: "CORNER"}


def vectors(mesh, name):
    return scenes.points_of(getattr(mesh, name), "vector")


def evaluated(obj):
    return scenes.evaluated(obj).data


def corners(obj):
    return vectors(evaluated(obj), "corner_normals")


def has_given(obj):
    """Whether the evaluated mesh has normals from Sinew."""
    attribute = evaluated(obj).attributes.get("custom_normal")
    return attribute is not None and attribute.data_type == "FLOAT_VECTOR"


def choose(obj, who):
    properties.of(obj).normals = who
    bpy.context.view_layer.update()


def both(obj, read=corners):
    """The values read with Sinew's normals, and with Blender's. Sinew's must be present unless they can
    not be."""
    choose(obj, GIVE)
    given = read(obj)
    choose(obj, LEAVE)
    left = read(obj)
    assert not has_given(obj)
    choose(obj, GIVE)
    return given, left


def check_given(obj):
    """They are present, and equal Blender's."""
    assert has_given(obj)
    given, left = both(obj)
    np.testing.assert_allclose(given, left, rtol=0, atol=NEAR)


def make(shading=smooth, frame=7):
    obj, armature = scenes.make_arm()
    shading(obj)
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(frame)
    return obj, armature


@needs_support
def test_commands_give_skinned_normals_alone(monkeypatch):
    monkeypatch.setattr(normals, "are_used", False)
    obj, _armature = make()
    assert not has_given(obj)
    choose(obj, properties.SKINNED_NORMALS)
    assert has_given(obj)


@pytest.mark.parametrize("shading", SHADINGS, ids=lambda each: each.__name__)
def test_normals_of_every_frame_are_blenders(shading):
    obj, armature = make(shading)
    assert evaluated(obj).normals_domain == (DOMAINS[shading] or "FACE")
    for frame in (1, 4, 7.5, 11):
        bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
        assert has_given(obj) == (normals.ARE_SUPPORTED and bool(DOMAINS[shading]))
        of_frame = corners(obj)
        given, left = both(obj)
        np.testing.assert_array_equal(given, of_frame)
        np.testing.assert_allclose(given, left, rtol=0, atol=NEAR)
        if shading is smooth:
            of_vertices = both(obj, lambda obj: vectors(evaluated(obj), "vertex_normals"))
            np.testing.assert_allclose(*of_vertices, rtol=0, atol=NEAR)
        if shading is not custom and has_given(obj):
            # Also equal to what Blender computes from the same points.
            plain = evaluated(obj).copy()
            plain.attributes.remove(plain.attributes["custom_normal"])
            np.testing.assert_allclose(given, vectors(plain, "corner_normals"), rtol=0, atol=NEAR)
    scenes.forget_keys(armature)
    scenes.bend(armature, 50.0)
    bpy.context.view_layer.update()
    given, left = both(obj)
    np.testing.assert_allclose(given, left, rtol=0, atol=NEAR)


def add_nodes_that_read(obj):
    """Another object whose Geometry Nodes read this one."""

    def read(group, _source):
        return node_group.add(group, "GeometryNodeObjectInfo", {"Object": obj}).outputs["Geometry"]

    add_other().modifiers.new("Reader", "NODES").node_group = scenes.nodes(read)


def add_other():
    other = scenes.added("Other", bpy.data.meshes.new("Other"))
    other.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    return other


def add_boolean_of_collection(obj):
    collection, outer = bpy.data.collections.new("Own"), bpy.data.collections.new("Outer")
    bpy.context.scene.collection.children.link(outer)
    outer.children.link(collection)
    collection.objects.link(obj)
    modifier = add_other().modifiers.new("Boolean", "BOOLEAN")
    modifier.operand_type, modifier.collection = "COLLECTION", outer


def add_shrinkwrap_of_bone(obj):
    _other, armature = scenes.make_arm(name="Other")
    armature.pose.bones[0].constraints.new("SHRINKWRAP").target = obj


def add_hair(obj):
    curves = bpy.data.hair_curves.new("Hair")
    curves.surface = obj
    scenes.added("Hair", curves)


OBSTACLES = {
    "weighted": (lambda obj: scenes.put_in_front(obj, "WEIGHTED_NORMAL", "Weighted"), "Weighted is in front"),
    "subdivision": (lambda obj: obj.modifiers.new("Subdivision", "SUBSURF"), "Subdivision follows"),
    "cast": (lambda obj: obj.modifiers.new("Cast", "CAST"), "Cast follows"),
    "nodes": (add_nodes_that_read, "another object"),
    "boolean": (
        lambda obj: setattr(add_other().modifiers.new("Boolean", "BOOLEAN"), "object", obj),
        "another object",
    ),
    "collection": (add_boolean_of_collection, "another object"),
    "shrinkwrap": (
        lambda obj: setattr(add_other().constraints.new("SHRINKWRAP"), "target", obj),
        "another object",
    ),
    "shrinkwrap of a bone": (add_shrinkwrap_of_bone, "another object"),
    "hair": (add_hair, "another object"),
    "instances": (lambda obj: setattr(obj, "instance_type", "FACES"), "instances"),
    "heat map": (lambda obj: setattr(obj.sinew, "heat", True), "its heat map is shown"),
}


@needs_support
@pytest.mark.parametrize("name", OBSTACLES)
def test_blender_computes_normals_where_other_objects_read_them(name):
    obj, _armature = make(sharp)
    assert has_given(obj)
    make_obstacle, reason = OBSTACLES[name]
    make_obstacle(obj)
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(5)
    assert not has_given(obj)
    assert reason in session.skinned_of(obj).plan.normals_reason
    given, left = both(obj)
    np.testing.assert_array_equal(given, left)


@needs_support
def test_an_input_that_names_the_object_later_is_noticed():
    """A script sets it: Blender then lists no more than the object whose modifier it is."""
    obj, _armature = make(sharp)
    group = scenes.nodes(lambda _group, source: source)
    group.interface.new_socket("Object", in_out="INPUT", socket_type="NodeSocketObject")
    other = add_other()
    modifier = other.modifiers.new("Reader", "NODES")
    modifier.node_group = group
    bpy.context.view_layer.update()
    assert has_given(obj)
    identifier = group.interface.items_tree["Object"].identifier
    if hasattr(modifier, "properties"):
        getattr(modifier.properties.inputs, identifier).value = obj
    else:
        modifier[identifier] = obj
    other.update_tag()
    bpy.context.view_layer.update()
    assert not has_given(obj)


def give_lattice(modifier):
    """A modifier that moves its points in every frame."""
    lattice = scenes.added("Lattice", bpy.data.lattices.new("Lattice"))
    lattice.scale = (4.0, 4.0, 4.0)
    lattice.data.points[0].co_deform.x -= 0.4
    scenes.key(lattice, "location", ((1, (0.0, 0.0, 0.0)), (11, (0.0, 0.0, 0.5))))
    modifier.object = lattice


def transfer_normals(modifier):
    modifier.object, modifier.use_loop_data = add_other(), True
    modifier.data_types_loops = {"CUSTOM_NORMAL"}


HARMLESS = [
    ("front", "LATTICE", give_lattice, {}, custom),
    ("front", "MIRROR", None, {"use_axis": (False, True, False)}, sharp),
    ("front", "SUBSURF", None, {}, smooth),
    ("front", "DATA_TRANSFER", transfer_normals, {}, sharp),
    ("front", "VERTEX_WEIGHT_EDIT", None, {"vertex_group": "bone.1"}, custom),
    ("behind", "VERTEX_WEIGHT_EDIT", None, {"vertex_group": "bone.1"}, custom),
    ("behind", "COLLISION", None, {}, sharp),
    ("behind", "UV_WARP", None, {}, smooth),
    ("behind", "CAST", None, {"show_viewport": False, "show_render": False}, smooth),
    ("behind", "SUBSURF", None, {"levels": 0}, smooth),
]


@needs_support
@pytest.mark.parametrize(("place", "kind", "set_up", "options", "shading"), HARMLESS)
def test_modifiers_that_leave_normals_to_sinew(place, kind, set_up, options, shading):
    obj, _armature = scenes.make_arm()
    shading(obj)
    modifier = obj.modifiers.new("Other", kind)
    for name, value in options.items():
        setattr(modifier, name, value)
    if set_up is not None:
        set_up(modifier)
    if place == "front":
        obj.modifiers.move(1, 0)
    scenes.add_sinew(obj, "dq")
    for frame in (3, 11):
        bpy.context.scene.frame_set(frame)
        check_given(obj)


@needs_support
def test_upstream_nodes_that_change_the_domain_of_normals():
    """The mesh itself is smooth, so there is room for normals of vertices; the nodes add sharp edges."""
    obj, _armature = scenes.make_arm()
    smooth(obj)

    def sharpen(group, source):
        inputs = {0: source, "Shade Smooth": False}
        return node_group.add(group, "GeometryNodeSetShadeSmooth", inputs, domain="EDGE")

    scenes.put_in_front(obj, "NODES").node_group = scenes.nodes(sharpen)
    scenes.add_sinew(obj, "dq")
    for frame in (3, 11):
        bpy.context.scene.frame_set(frame)
        assert not has_given(obj)
        given, left = both(obj)
        np.testing.assert_array_equal(given, left)


@needs_support
def test_free_normals_of_the_mesh_stay():
    obj, _armature = scenes.make_arm()
    smooth(obj)
    attribute = obj.data.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
    attribute.data.foreach_set("vector", np.tile(np.float32([0, 0, 1]), len(obj.data.vertices)))
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(7)
    assert session.skinned_of(obj).plan.normals.domain == ""
    assert (corners(obj) == (0, 0, 1)).all()


@pytest.mark.parametrize("shading", SHADINGS, ids=lambda each: each.__name__)
@pytest.mark.parametrize("how", ["apply", "convert"])
def test_applying_adds_no_normals(how, shading):
    found = []
    for who in (LEAVE, GIVE):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        obj, _armature = make(shading)
        choose(obj, who)
        bpy.context.view_layer.objects.active = obj
        if how == "apply":
            bpy.ops.object.modifier_apply(modifier=stack.sinew_modifier(obj).name)
        else:
            bpy.ops.object.convert(target="MESH")
        bpy.context.view_layer.update()
        assert not properties.has_sinew(obj)
        mesh = obj.data
        kinds = {each.name: (each.data_type, each.domain) for each in mesh.attributes}
        found.append((kinds, *(vectors(mesh, each) for each in (*COLLECTIONS, "polygon_normals"))))
    assert found[0][0] == found[1][0]
    for left, given in zip(found[0][1:], found[1][1:], strict=True):
        np.testing.assert_allclose(given, left, rtol=0, atol=NEAR)


def light_scene(obj):
    """A camera and a lamp that see the arm, whose material has a tangent-space map of normals across
    seams."""
    scene = bpy.context.scene
    scene.camera = camera = scenes.added("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (1.0, -5.0, 1.0), (1.4, 0.0, 0.0)
    lamp = scenes.added("Lamp", bpy.data.lights.new("Lamp", "SUN"))
    lamp.rotation_euler, lamp.data.energy = (0.8, 0.3, 0.0), 3.0
    uv = obj.data.uv_layers.new(name="UVMap")
    uv.data.foreach_set("uv", np.random.default_rng(3).random(2 * len(uv.data), dtype=np.float32))
    material = bpy.data.materials.new("Skin")
    material.use_nodes = True
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    bumps, shader = nodes.new("ShaderNodeNormalMap"), nodes["Principled BSDF"]
    bumps.inputs["Color"].default_value = (0.65, 0.4, 0.9, 1.0)
    link(bumps.outputs["Normal"], shader.inputs["Normal"])
    shader.inputs["Roughness"].default_value = 0.2
    obj.data.materials.append(material)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 160, 120, 100
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 4, False, "CPU"


def pixels(path):
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return scenes.pixels_of(path)


def assert_same_pictures(obj, tmp_path, is_custom, step=0.0):
    given, left = both(obj, lambda _obj: pixels(tmp_path / "picture.exr"))
    if is_custom:
        # Their rounding differs. This changes a pixel by at most one step, except where a ray just hits or
        # misses.
        assert (np.abs(given - left) > 1e-4).mean() < 1e-4
    else:
        np.testing.assert_allclose(given, left, rtol=0, atol=step)
    # Other normals would be visible.
    properties.of(obj).enabled = False
    (flat if evaluated(obj).normals_domain != "FACE" else smooth)(obj)
    bpy.context.view_layer.update()
    assert (np.abs(pixels(tmp_path / "picture.exr") - left) > 1e-3).mean() > 0.01


@needs_support
@by_one_route_first
@pytest.mark.parametrize("engine", ["CYCLES", "CYCLES blurred", "BLENDER_WORKBENCH"])
@pytest.mark.parametrize("shading", [smooth, sharp, custom], ids=lambda each: each.__name__)
def test_pictures_are_the_same(shading, engine, tmp_path):
    if engine == "BLENDER_WORKBENCH" and not has_opengl():
        pytest.skip("Workbench can not draw here")
    obj, _armature = make(shading)
    light_scene(obj)
    render = bpy.context.scene.render
    render.engine, _space, blur = engine.partition(" ")
    render.use_motion_blur = bool(blur)
    render.motion_blur_shutter = 1.5
    if not render.use_motion_blur:
        obj.scale = (1.0, -1.2, 0.9)
    bpy.context.view_layer.update()
    assert has_given(obj)
    # Workbench in 5.3, with Sinew or without, smooths the edges of a file that does not change in two ways
    # (a pixel differs by 4e-4 from one picture to the next).
    bpy.context.scene.display.render_aa = "OFF"
    # Cycles mixes the normals of several moments: in 4.5, three pixels of a thousand differ by a step.
    step = 2e-7 if blur and shading is sharp else 0.0
    assert_same_pictures(obj, tmp_path, shading is custom, step)


@needs_support
def test_what_is_on_in_renders_alone_is_an_obstacle_there(tmp_path):
    obj, _armature = make(smooth)
    light_scene(obj)
    bpy.context.scene.render.engine = "CYCLES"
    modifier = obj.modifiers.new("Cast", "CAST")
    modifier.factor = 0.8
    modifier.show_viewport = modifier.show_render = False
    bpy.context.view_layer.update()
    assert has_given(obj)
    modifier.show_render = True
    given = pixels(tmp_path / "picture.exr")
    # The viewport has Sinew's, if no modifier follows.
    assert has_given(obj)
    choose(obj, LEAVE)
    np.testing.assert_allclose(given, pixels(tmp_path / "picture.exr"), rtol=0, atol=1e-5)


EXPORTERS = {
    "obj": lambda path: bpy.ops.wm.obj_export(filepath=path, export_materials=False),
    "stl": lambda path: bpy.ops.wm.stl_export(filepath=path),
    "usda": lambda path: bpy.ops.wm.usd_export(filepath=path, export_animation=True),
    "abc": lambda path: bpy.ops.wm.alembic_export(filepath=path, start=3, end=4, as_background_job=False),
    "glb": lambda path: bpy.ops.export_scene.gltf(filepath=path),
}


@needs_support
@by_one_route_first
@pytest.mark.parametrize("kind", EXPORTERS)
@pytest.mark.parametrize("shading", SHADINGS, ids=lambda each: each.__name__)
def test_exported_files_are_the_same(shading, kind, tmp_path):
    if kind == "abc" and not bpy.app.build_options.alembic:
        pytest.skip("this Blender writes no Alembic")
    obj, _armature = make(shading)
    bpy.context.scene.frame_end = 4

    def written(_obj):
        path = tmp_path / f"file.{kind}"
        EXPORTERS[kind](str(path))
        return path.read_bytes()

    given, left = both(obj, written)
    if kind == "abc":
        (given, kinds), (left, others) = (imported_alembic(data, tmp_path) for data in (given, left))
        assert kinds == others
        # As precise as a mesh stores them.
        np.testing.assert_allclose(given, left, rtol=0, atol=1e-4)
    elif kind in ("obj", "usda"):
        assert_same_numbers(given, left)
    else:
        assert given == left


def assert_same_numbers(a, b):
    """Compares two texts whose objects are in any order."""
    a, b = (b"\n".join(sorted(text.split(b"\n"))) for text in (a, b))
    split = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
    assert split.sub(b"#", a) == split.sub(b"#", b)
    numbers = [np.array(split.findall(text), dtype=np.float64) for text in (a, b)]
    np.testing.assert_allclose(*numbers, rtol=0, atol=1e-6)


def imported_alembic(data, tmp_path):
    """What Blender reads from a file, which contains the time of writing."""
    path = tmp_path / "again.abc"
    path.write_bytes(data)
    before = set(bpy.data.objects)
    bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    made = set(bpy.data.objects) - before
    (obj,) = (each for each in made if each.type == "MESH")
    mesh = scenes.evaluated(obj).data
    found = (
        vectors(mesh, "corner_normals"),
        sorted((each.name, each.data_type, each.domain) for each in mesh.attributes),
    )
    for each in made:
        bpy.data.objects.remove(each)
    return found


def test_a_mesh_that_is_not_valid_has_none():
    # Two triangles and no edges.
    topology = Topology(np.int32([0, 3, 6]), np.int32([0, 1, 2, 2, 1, 3]), np.empty((0, 2), np.int32))
    normals_of_it = SurfaceNormals(4, topology, Shading(sharp_faces=np.array([True, False])))
    found = np.ones((6, 3), np.float32)
    normals_of_it.write(np.eye(4, 3, dtype=np.float32), "CORNER", found)
    assert not found.any()


@needs_support
@pytest.mark.parametrize("shading", [smooth, sharp, custom], ids=lambda each: each.__name__)
def test_skinned_normals_move_by_the_inverse_transpose_of_the_blend(shading):
    obj, armature = make(shading)
    properties.of(obj).method = "lbs"
    armature.location = (0.3, 0.2, -0.1)
    armature.rotation_euler = (0.2, 0.1, 0.4)
    for bone in armature.pose.bones:
        bone.scale = (1.0, 1.4, 0.7)
    properties.of(obj).normals = properties.SKINNED_NORMALS
    rest = vectors(obj.data, "corner_normals").astype(np.float64)
    corner_vertices = np.array([loop.vertex_index for loop in obj.data.loops])
    offsets, bones, weights = scenes.weights_of(obj)
    for frame in (5, 11):
        bpy.context.scene.frame_set(frame)
        assert session.skinned_of(obj).plan.normals.are_skinned
        assert has_given(obj)
        place = np.linalg.inv(np.array(obj.matrix_world)) @ np.array(armature.matrix_world)
        motions = place @ scenes.bone_motions(armature) @ np.linalg.inv(place)
        blends = np.zeros((len(obj.data.vertices), 3, 3))
        for vertex in range(len(blends)):
            own = slice(offsets[vertex], offsets[vertex + 1])
            total = weights[own].astype(np.float64).sum()
            for bone, weight in zip(bones[own], weights[own], strict=True):
                blends[vertex] += weight / total * motions[bone][:3, :3]
        expected = np.einsum("nji,nj->ni", np.linalg.inv(blends)[corner_vertices], rest)
        expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        np.testing.assert_allclose(corners(obj), expected, rtol=0, atol=2e-5)
    # Shape keys change the rest normals.
    scenes.key_shape(obj)
    for point in obj.data.shape_keys.key_blocks["Key"].data:
        point.co.y *= 0.4
    bpy.context.scene.frame_set(9)
    before = corners(obj)
    obj.data.shape_keys.key_blocks["Key"].mute = True
    bpy.context.view_layer.update()
    assert np.abs(before - corners(obj)).max() > 0.01


@needs_support
def test_skinned_normals_with_a_stage_are_blenders():
    obj, _armature = make(smooth)
    settings = properties.of(obj)
    settings.normals = properties.SKINNED_NORMALS
    settings.delta_mush.enabled = True
    bpy.context.scene.frame_set(9)
    given = corners(obj)
    choose(obj, LEAVE)
    np.testing.assert_allclose(given, corners(obj), rtol=0, atol=NEAR)
