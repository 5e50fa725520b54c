# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct delta mush in Blender: its shape equals the float64 reference's, and a new radius recomputes its
data."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import reference
import scenes
import sinew
from conftest import look_until_done
from sinew_addon.attach import attach, properties
from sinew_addon.deform import session

pytestmark = pytest.mark.long_term

if "ddm" not in {method.name for method in sinew.methods()}:
    pytest.skip("built without ddm", allow_module_level=True)

FRAME = 8


def moments_of(obj: bpy.types.Object, radius: float) -> np.ndarray:
    points = np.float32([vertex.co[:] for vertex in obj.data.vertices])
    influences, triangles = scenes.weights_of(obj), scenes.triangles_of(obj)
    return sinew.direct_delta_mush(points, *influences, triangles, np.float32(radius)).result()


def assert_equal_to_reference(obj: bpy.types.Object, radius: float, variant: str = "0") -> None:
    armature = attach.armature_of(obj)
    to_armature = np.array(armature.matrix_world.inverted() @ obj.matrix_world)
    # Motions in the object's space: a rotation and a translation map it to the armature's.
    motions = np.linalg.inv(to_armature) @ scenes.bone_motions(armature) @ to_armature
    expected, margins = reference.deform(
        "ddm",
        scenes.rest_points(obj),
        *scenes.weights_of(obj),
        motions,
        None,
        {"ddm": moments_of(obj, radius)},
        {"ddm.variant": variant},
    )
    decided = margins > 1e-3
    assert decided.mean() > 0.9
    found = scenes.final_points(obj)
    assert scenes.worst(found[decided], expected[decided]) <= 2 * scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("variant", ["0", "2", "4"])
def test_a_mesh_that_lies_elsewhere(variant, route):
    obj, armature = scenes.make_arm(bones=3)
    obj.location, obj.rotation_euler = (0.4, -1.0, 0.3), (0.2, 0.5, 0.1)
    armature.location = (1.0, 2.0, -0.5)
    bpy.context.view_layer.update()
    scenes.add_sinew(obj, "ddm")
    settings = properties.of(obj).ddm
    settings.radius, settings.variant = 0.2, variant
    bpy.context.scene.frame_set(FRAME)
    assert_equal_to_reference(obj, 0.2, variant)


def test_another_radius_makes_the_data_anew(route):
    obj, _armature = scenes.skinned_arm("ddm", bones=3)
    bpy.context.scene.frame_set(FRAME)
    assert_equal_to_reference(obj, 0.05)
    before = scenes.final_points(obj)
    for radius in (0.3, 0.05):
        properties.of(obj).ddm.radius = radius
        bpy.context.view_layer.update()
        assert_equal_to_reference(obj, radius)
        is_back = radius == 0.05
        assert (scenes.worst(scenes.final_points(obj), before) < 1e-6) == is_back


def test_in_a_window_the_old_radius_stays_until_the_new_is_computed(in_window):
    obj, _armature = scenes.make_arm(bones=3)
    bpy.context.scene.frame_set(FRAME)
    scenes.add_sinew(obj, "ddm")
    look_until_done()
    assert not session.skinned_of(obj).plan.lacks
    assert_equal_to_reference(obj, 0.05)
    before = scenes.final_points(obj)
    properties.of(obj).ddm.radius = 0.3
    bpy.context.view_layer.update()
    assert not session.skinned_of(obj).plan.lacks
    assert scenes.worst(scenes.final_points(obj), before) < 1e-6
    look_until_done()
    assert_equal_to_reference(obj, 0.3)


@pytest.mark.parametrize("stage", ["ddm", "delta_mush"])
@pytest.mark.parametrize("when", ["before", "after", "unequal"])
def test_a_radius_is_in_units_of_the_scene(stage, when, route):
    """A character a hundredth as large, with a radius a hundredth as large, has the same shape."""
    scales = (0.01, 0.01, 0.01) if when != "unequal" else (0.005, 0.02, 0.01)
    shapes = []
    for is_small in (False, True):
        obj, armature = scenes.make_arm(bones=3)
        obj.parent = armature
        bpy.context.scene.frame_set(FRAME)
        armature.scale = scales if is_small and when != "after" else (1.0, 1.0, 1.0)
        bpy.context.view_layer.update()
        scenes.add_sinew(obj, "ddm" if stage == "ddm" else "lbs")
        group = getattr(properties.of(obj), stage)
        if stage == "delta_mush":
            group.enabled = True
        group.radius = 0.002 if is_small else 0.2
        bpy.context.view_layer.update()
        armature.scale = scales if is_small else (1.0, 1.0, 1.0)
        bpy.context.view_layer.update()
        shapes.append(scenes.final_points(obj))
        group.radius = 0.0
        bpy.context.view_layer.update()
        assert scenes.worst(shapes[-1], scenes.final_points(obj)) > 0.01
    assert scenes.worst(*shapes) < 1e-5


def test_a_radius_scales_along_with_animation_and_stays_in_earlier_files(tmp_path, route):
    obj, armature = scenes.make_arm(bones=3)
    obj.parent = armature
    bpy.context.scene.frame_set(FRAME)
    scenes.add_sinew(obj, "ddm")
    properties.of(obj).ddm.radius = 0.2
    bpy.context.view_layer.update()
    before = scenes.final_points(obj)
    scenes.key(armature, "scale", [(FRAME, (1.0, 1.0, 1.0)), (FRAME + 1, (3.0, 3.0, 3.0))])
    for bone in armature.pose.bones:
        bone.keyframe_insert("rotation_quaternion", frame=FRAME)
        bone.keyframe_insert("location", frame=FRAME)
    armature.animation_data.action.name = "Grows"
    bpy.context.scene.frame_set(FRAME)
    assert scenes.worst(scenes.final_points(obj), before) < 1e-6
    # What earlier versions stored.
    scenes.forget_keys(armature)
    armature.scale = (0.1, 0.1, 0.1)
    properties.of(obj).storage.property_unset("world_scale")
    obj = scenes.reopened(scenes.save(tmp_path / "a.blend"))
    assert_equal_to_reference(obj, 0.2)
