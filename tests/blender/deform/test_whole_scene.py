# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender changes for all objects of a scene at once, which what stands in front of the Armature
modifier has to follow, and edits in a scene that no window shows."""

from __future__ import annotations

import bpy
import pytest
import scenes
from sinew_addon.attach import properties

FRAMES = (9, 10, 6)


def subdivision(obj, armature):
    front = scenes.put_in_front(obj)
    front.levels, front.render_levels = 2, 2


def multires(obj, armature):
    scenes.put_in_front(obj, "MULTIRES")
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.multires_subdivide(modifier="Front")


def camera_aware(obj, armature):
    """Moves the mesh by the place of the scene's camera."""
    camera = bpy.context.scene.camera = scenes.added("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 0.3)

    def make(group, source):
        active = group.nodes.new("GeometryNodeInputActiveCamera")
        info = group.nodes.new("GeometryNodeObjectInfo")
        move = group.nodes.new("GeometryNodeSetPosition")
        group.links.new(active.outputs[0], info.inputs["Object"])
        group.links.new(info.outputs["Location"], move.inputs["Offset"])
        group.links.new(source.outputs[0], move.inputs["Geometry"])
        return move.outputs[0]

    scenes.put_in_front(obj, "NODES").node_group = scenes.nodes(make)


def timed(obj, armature):
    wave = scenes.put_in_front(obj, "WAVE")
    wave.height, wave.time_offset = 0.3, -20.0


def set_simplify(levels):
    def act(scene):
        scene.render.use_simplify = True
        scene.render.simplify_subdivision = scene.render.simplify_subdivision_render = levels

    return act


def stretch_time(scene):
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 50


def set_units(scene):
    scene.unit_settings.scale_length = 0.01


def other_camera(scene):
    scene.camera = scenes.added("Other", bpy.data.cameras.new("Other"))
    scene.camera.location = (0.0, 0.5, 0.0)


def move_camera(scene):
    scene.camera.location.z += 0.4


CASES = {
    "simplified to 0": (subdivision, set_simplify(0)),
    "simplified to 1": (subdivision, set_simplify(1)),
    "multires": (multires, set_simplify(0)),
    "time stretched": (timed, stretch_time),
    "other units": (subdivision, set_units),
    "another camera": (camera_aware, other_camera),
    "a moved camera": (camera_aware, move_camera),
}


def shapes_while(obj, act):
    scene, found = bpy.context.scene, []
    scene.frame_set(9)
    found.append(scenes.final_points(obj))
    act(scene)
    bpy.context.view_layer.update()
    found.append(scenes.final_points(obj))
    found += [scenes.shapes(obj, [frame])[0] for frame in FRAMES]
    scene.render.use_simplify = False
    bpy.context.view_layer.update()
    return [*found, scenes.final_points(obj)]


def assert_alike(got, expected, obj):
    for number, (mine, its) in enumerate(zip(got, expected, strict=True)):
        assert mine.shape == its.shape, number
        assert scenes.worst(mine, its) <= scenes.TOLERANCE * scenes.diagonal(obj), number


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("case", CASES)
def test_it_is_followed(case):
    front, act = CASES[case]
    found = []
    for is_with_sinew in (False, True):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        obj, armature = scenes.make_arm()
        front(obj, armature)
        if is_with_sinew:
            scenes.add_sinew(obj)
        found.append(shapes_while(obj, act))
    assert_alike(found[1], found[0], obj)


@pytest.mark.usefixtures("route")
def test_simplify_that_keys_switch(rendered_points):
    obj, armature = scenes.make_arm()
    subdivision(obj, armature)
    render = bpy.context.scene.render
    scenes.key(render, "use_simplify", ((1, False), (6, True), (9, False)))
    render.simplify_subdivision = render.simplify_subdivision_render = 1
    frames = (5, 6, 7, 9, 8)
    expected = [scenes.shapes(obj, [frame])[0] for frame in frames]
    assert len({len(shape) for shape in expected}) == 2, "nothing is tested"
    scenes.add_sinew(obj)
    assert_alike([scenes.shapes(obj, [frame])[0] for frame in frames], expected, obj)
    for frame, wanted in zip(frames, expected, strict=True):
        bpy.context.scene.frame_set(1)
        bpy.context.scene.frame_current = frame
        assert_alike([rendered_points(obj)], [wanted], obj)


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("front", ["SUBSURF", "MIRROR", None])
def test_an_edit_in_a_scene_that_no_window_shows(front):
    obj, _armature = scenes.make_arm()
    if front is not None:
        scenes.put_in_front(obj, front)
    scenes.add_sinew(obj)
    scene = bpy.context.scene
    scene.frame_set(8)
    bpy.context.window.scene = bpy.data.scenes.new("Shown")
    layer = scene.view_layers[0]

    def points():
        return scenes.points_of(obj.evaluated_get(layer.depsgraph).data.vertices)

    layer.update()
    before = points()
    for vertex in list(obj.data.vertices)[::3]:
        vertex.co.z += 0.2
    obj.data.update()
    layer.update()
    got = points()
    assert scenes.worst(got, before) > 0.05
    bpy.context.window.scene = scene
    scenes.assert_as_without(obj, got)


@pytest.mark.usefixtures("route")
def test_a_render_of_what_the_viewport_hides(rendered_points):
    """There, a Subdivision without levels makes no mesh of its own."""
    obj, _armature = scenes.make_arm()
    scenes.put_in_front(obj)
    obj.hide_viewport = True
    scenes.add_sinew(obj, "lbs")
    set_simplify(0)(bpy.context.scene)
    bpy.context.view_layer.update()
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        got = rendered_points(obj)
        properties.of(obj).enabled = False
        expected = rendered_points(obj)
        properties.of(obj).enabled = True
        assert scenes.worst(got, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
        assert scenes.worst(got, scenes.rest_points(obj)) > 0.05, "nothing is tested"
