# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage bulge_limit: its oracle is the float64 reference, from the shape before it and Blender's poses.
Objects at other places, masks and shape keys are in the fuzzer."""

from __future__ import annotations

import bpy
import bulge_limit_reference
import numpy as np
import pytest
import routes
import scenes
from sinew_addon.attach import attach, properties
from sinew_addon.deform import session
from sinew_addon.skinning.bulge_limit import segments

pytestmark = pytest.mark.long_term


def limit(obj: bpy.types.Object, **values: object) -> None:
    scenes.set_stage(obj, "bulge_limit", **values)


def expected_points(obj: bpy.types.Object, before: np.ndarray, **options: object) -> np.ndarray:
    """The limited shape by float64 in this frame, for objects at one place.

    before  float32 [vertices, 3], the shape without the stage
    """
    armature = attach.armature_of(obj)
    motions = scenes.bone_motions(armature)
    heads = np.array([bone.head_local[:] for bone in armature.data.bones])
    tails = np.array([bone.tail_local[:] for bone in armature.data.bones])
    shapes = before.astype(np.float64), scenes.rest_points(obj).astype(np.float64)
    return bulge_limit_reference.limit(*shapes, *scenes.weights_of(obj), heads, tails, motions, **options)


def assert_limited(obj: bpy.types.Object, before: np.ndarray, **options: object) -> None:
    found, expected = scenes.final_points(obj), expected_points(obj, before, **options)
    assert np.abs(expected - before).max() > 0.005
    assert scenes.worst(found, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def bent_arm(method: str = "dq") -> tuple[bpy.types.Object, np.ndarray]:
    """The object at frame 11, and its shape there without the stage."""
    obj, _armature = scenes.skinned_arm(method, bones=3)
    bpy.context.scene.frame_set(11)
    return obj, scenes.final_points(obj)


@pytest.mark.parametrize("method", ["dq", "cor"])
@pytest.mark.parametrize("form", ["continuous", "kim_han"])
def test_a_bent_arm_has_the_shape_of_the_reference(form, method, route):
    obj, before = bent_arm(method)
    limit(obj, form=form, strength=0.75)
    assert_limited(obj, before, form=form, strength=0.75)
    bpy.context.scene.frame_set(1)
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) < 1e-7
    bpy.context.scene.frame_set(11)
    assert_limited(obj, before, form=form, strength=0.75)
    assert routes.taken(obj, 0) == route


def test_keys_of_its_strength_are_followed():
    obj, before = bent_arm()
    limit(obj)
    stage = properties.of(obj).bulge_limit
    scenes.key(stage, "strength", ((9, 0.0), (11, 1.0)))
    bpy.context.scene.frame_set(9)
    stage.enabled = False
    at_9 = scenes.final_points(obj)
    stage.enabled = True
    np.testing.assert_array_equal(scenes.final_points(obj), at_9)
    bpy.context.scene.frame_set(11)
    assert_limited(obj, before)


def test_bendy_bones_are_limited_along_their_curve():
    obj, armature = scenes.make_arm(bones=2)
    armature.data.bones[0].bbone_segments = 4
    scenes.add_sinew(obj, "lbs")
    armature.pose.bones[0].bbone_curveoutx = 0.4
    bpy.context.scene.frame_set(11)
    before = scenes.final_points(obj)
    bones = session.skinned_of(obj).bound.first_deformer.bones
    heads, tails = segments(bones)
    first = bones.first_joints[0]
    along = np.linspace(0.0, 1.0, 5)
    np.testing.assert_allclose(heads[first : first + 5, 0], [0.0, *along[:-1]], atol=1e-6)
    np.testing.assert_allclose(tails[first : first + 5, 0], [*along[1:], 1.0], atol=1e-6)
    limit(obj)
    # Linear blending loses volume: only where the curve ends is anything far from its bones.
    found = scenes.final_points(obj)
    assert np.isfinite(found).all()
    assert np.abs(found - before).max() < 0.1
    bpy.context.scene.frame_set(1)
    armature.pose.bones[0].bbone_curveoutx = 0.0
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) < 1e-5
