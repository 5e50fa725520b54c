# SPDX-License-Identifier: GPL-3.0-or-later
"""One character that is shown more than once: in two scenes at different frames, and as an instance."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import routes
import scenes
from sinew_addon.attach import attach
from sinew_addon.deform import handlers, session

pytestmark = pytest.mark.both_ways


def points_in(obj: bpy.types.Object, scene: bpy.types.Scene) -> np.ndarray:
    return scenes.points_of(obj.evaluated_get(scene.view_layers[0].depsgraph).data.vertices)


def instanced_points() -> np.ndarray:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    # Data of an instance is invalid outside the loop.
    for instance in depsgraph.object_instances:
        if instance.is_instance and instance.object.type == "MESH":
            points = scenes.points_of(instance.object.data.vertices)
    return points


def test_two_scenes_at_different_frames():
    obj, armature = scenes.make_arm()
    expected = {frame: scenes.shapes(obj, [frame])[0] for frame in (3, 9)}
    first, second = bpy.context.scene, bpy.data.scenes.new("Second")
    for each in (obj, armature):
        second.collection.objects.link(each)
    scenes.add_sinew(obj, "lbs")
    for _round in range(2):
        first.frame_set(3)
        second.frame_set(9)
        assert scenes.worst(points_in(obj, first), expected[3]) <= 1e-5
        assert scenes.worst(points_in(obj, second), expected[9]) <= 1e-5
        first.frame_set(3)
        assert scenes.worst(points_in(obj, first), expected[3]) <= 1e-5


def test_a_view_layer_is_shown_for_the_first_time(route):
    """Blender sends no notification of its first evaluation, nor of changes by handlers after Sinew's."""
    obj, armature = scenes.make_arm()
    scene, first = bpy.context.scene, bpy.context.view_layer

    def lift(*_args: object) -> None:
        armature.delta_location.z = 0.5

    try:
        scenes.add_sinew(obj, "lbs")
        scene.frame_set(5)
        unmoved = scenes.final_points(obj)
        with scenes.handler("frame_change_post", lift):
            scene.frame_set(5)
        bpy.context.window.view_layer = scene.view_layers.new("Second")
        bpy.context.view_layer.update()
        handlers.check_unannounced()
        shown = scenes.final_points(obj)
        assert scenes.worst(shown, unmoved) > 0.1, "nothing is tested"
        scenes.assert_as_without(obj, shown)
    finally:
        bpy.context.window.view_layer = first


def test_undo_with_a_view_layer_that_is_not_shown(route):
    """Blender keeps the point buffer's evaluated data from before the step that undo goes back to: points
    of another frame, or as many as another subdivision had."""
    obj, _armature = scenes.make_arm()
    scene, first = bpy.context.scene, bpy.context.view_layer
    first_name = first.name
    front = scenes.put_in_front(obj)
    for frame, front.levels in ((4, 1), (9, 2)):
        front.keyframe_insert("levels", frame=frame)
    bpy.context.window.view_layer = scene.view_layers.new("Second")
    bpy.context.view_layer.update()

    def push() -> None:
        # If data is added or removed, a step is one of the whole file.
        bpy.data.texts.remove(bpy.data.texts.new("step"))
        bpy.ops.ed.undo_push(message="step")

    try:
        scenes.add_sinew(obj, "lbs")
        scene.frame_set(4)
        push()
        scene.frame_set(9)
        push()
        attach.remove(obj)
        session.forget()
        push()
        bpy.ops.ed.undo()
        bpy.ops.ed.undo()
        bpy.context.view_layer.update()
        scene = bpy.context.scene
        bpy.context.window.view_layer = scene.view_layers[first_name]
        bpy.context.view_layer.update()
        handlers.check_unannounced()
        obj = bpy.data.objects["Arm"]
        shown, plan = scenes.final_points(obj), session.skinned_of(obj).plan
        assert (scene.frame_current, obj.modifiers["Front"].levels) == (4, 1), "nothing is tested"
        scenes.assert_as_without(obj, shown)
        assert plan.is_in_depsgraph == (route == routes.EVALUATION), plan.reason
    finally:
        bpy.context.window.view_layer = bpy.context.scene.view_layers[first_name]


def test_an_instanced_collection():
    obj, armature = scenes.make_arm()
    collection = bpy.data.collections.new("Character")
    scenes.move_to(collection, obj, armature)
    empty = scenes.added("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    expected = []
    for frame in (1, 9):
        bpy.context.scene.frame_set(frame)
        expected.append(instanced_points())
    scenes.add_sinew(obj, "lbs")
    for frame, points in zip((1, 9), expected, strict=True):
        bpy.context.scene.frame_set(frame)
        assert scenes.worst(instanced_points(), points) <= 1e-5


def test_an_exporters_evaluation_is_not_taken_for_a_viewports(tmp_path):
    """In a viewport's alone, Sinew switches Armature modifiers off."""
    obj, _armature = scenes.skinned_arm("dq")
    for frame in (3, 4):
        bpy.context.scene.frame_set(frame)
    bpy.ops.wm.usd_export(
        filepath=str(tmp_path / "arm.usda"), export_animation=True, evaluation_mode="VIEWPORT"
    )
    shown = obj.data.evaluated_get(bpy.context.view_layer.depsgraph).as_pointer()
    assert session.skinned_of(obj).viewport_mesh == shown
