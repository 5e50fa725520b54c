# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of the Armature modifiers that keys or drivers set: each frame has the shape of its own. Vertex
Groups, Bone Envelopes and the names of groups can not be animated."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach
from sinew_addon.deform import session
from sinew_addon.io import actions

FRAMES = [1, 3, 6, 8, 11]
OPTIONS = {
    "Preserve Volume": "use_deform_preserve_volume",
    "Invert": "invert_vertex_group",
    "Multi Modifier": "use_multi_modifier",
}


def by_keys(obj, modifier, path):
    first = getattr(modifier, path)
    scenes.key(modifier, path, ((1, first), (6, not first)))


def by_driver(obj, modifier, path):
    rig = modifier.object
    rig["option"] = 0
    for frame, value in ((1, 0), (6, 1)):
        rig["option"] = value
        rig.keyframe_insert('["option"]', frame=frame)
    driver = modifier.driver_add(path).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = rig, '["option"]'


def two_modifiers(option):
    """An arm with a second modifier that is masked; returns the arm and the modifier that has the option."""
    obj, armature = scenes.make_arm(bones=3)
    scenes.paint(obj, "half", np.linspace(0.0, 0.9, len(obj.data.vertices)))
    modifier = obj.modifiers["Armature"]
    if option == "Invert":
        modifier.vertex_group = "half"
    elif option != "Preserve Volume":
        modifier = obj.modifiers.new("Second", "ARMATURE")
        modifier.object, modifier.vertex_group = armature, "half"
        modifier.use_deform_preserve_volume = True
    bpy.context.scene.frame_set(1)
    return obj, modifier


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("animate", [by_keys, by_driver])
@pytest.mark.parametrize("option", OPTIONS)
def test_each_frame_has_its_own(option, animate):
    obj, modifier = two_modifiers(option)
    animate(obj, modifier, OPTIONS[option])
    expected = scenes.shapes(obj, FRAMES)
    assert scenes.worst(expected[-1], expected[0]) > 0.1, "nothing is tested"
    bpy.context.scene.frame_set(1)
    scenes.add_sinew(obj)
    # Back and forth, as scrubbing does.
    for frames in (FRAMES, FRAMES[::-1]):
        wanted = expected if frames is FRAMES else expected[::-1]
        got = scenes.shapes(obj, frames)
        assert scenes.worst(got, wanted) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("option", OPTIONS)
def test_a_render_has_its_own(option, rendered_points):
    obj, modifier = two_modifiers(option)
    by_keys(obj, modifier, OPTIONS[option])
    expected = scenes.shapes(obj, [5, 6])
    scenes.add_sinew(obj)
    for frame, wanted in zip((5, 6), expected, strict=True):
        bpy.context.scene.frame_set(1)
        bpy.context.scene.frame_current = frame
        assert scenes.worst(rendered_points(obj), wanted) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_method_that_no_modifier_has_is_not_followed():
    obj, modifier = two_modifiers("Preserve Volume")
    scenes.add_sinew(obj, "qv")
    expected = scenes.shapes(obj, FRAMES)
    by_keys(obj, modifier, OPTIONS["Preserve Volume"])
    assert np.array_equal(scenes.shapes(obj, FRAMES), expected)
    assert attach.notes(obj) == []
    obj.sinew.method = "lbs"
    assert any("Preserve Volume is animated" in note for note in attach.notes(obj))


def test_what_is_measured_has_the_frames_own():
    """Also of a small mesh, which its Armature modifiers deform."""
    obj, modifier = two_modifiers("Invert")
    by_keys(obj, modifier, OPTIONS["Invert"])
    expected = scenes.shapes(obj, FRAMES)
    scenes.add_sinew(obj)
    for frame, wanted in zip(FRAMES, expected, strict=True):
        bpy.context.scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        ((_obj, state),) = session.deformed_now([obj], depsgraph)
        assert scenes.worst(state.points, wanted) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("method", ["lbs", "qv"])
def test_an_icon_that_is_keyed_beside_a_keyed_method_counts_at_once(method):
    """Blender evaluates the object without copying it again, so what Sinew had left out is still off."""
    obj, armature = scenes.make_arm()
    scenes.bend(armature, 60.0)
    bpy.context.scene.frame_set(6)
    rest = scenes.rest_points(obj)
    scenes.add_sinew(obj, method)
    scenes.key(obj.sinew, "method", ((2, "qv"), (8, "qv")))
    bpy.context.scene.frame_set(6)
    modifier = obj.modifiers["Armature"]
    for path in ("show_viewport", "show_render"):
        for frame in (1, 7):
            modifier.keyframe_insert(path, frame=frame)
        curve = next(each for each in actions.curves_of(obj) if each.data_path.endswith(path))
        curve.keyframe_points[0].co.y = 0.0
        curve.keyframe_points[0].interpolation = "CONSTANT"
    bpy.context.scene.frame_set(6)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(scenes.final_points(obj), rest, atol=1e-6)
    bpy.context.scene.frame_set(7)
    assert scenes.worst(scenes.final_points(obj), rest) > 0.1
