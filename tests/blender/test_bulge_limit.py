# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage bulge_limit: its oracle is the float64 reference, from the shape before it and Blender's
poses."""

from __future__ import annotations

import sys

import bpy
import numpy as np
import pytest
import routes
import scenes
from conftest import REPOSITORY
from sinew_addon.attach import attach, properties
from sinew_addon.core.bulge_limit import segments
from sinew_addon.deform import session

sys.path.append(str(REPOSITORY / "tests" / "python"))
import bulge_limit_reference


def limit(obj: bpy.types.Object, **values: object) -> None:
    stage = properties.of(obj).bulge_limit
    for name, value in values.items():
        setattr(stage, name, value)
    stage.enabled = True


def expected_points(
    obj: bpy.types.Object,
    before: np.ndarray,
    rest: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    **options: object,
) -> np.ndarray:
    """The limited shape by float64 in this frame.

    before  float32 [vertices, 3], the shape without the stage, object space
    rest    the same for the rest shape; None: the mesh's points
    """
    armature = attach.armature_of(obj)
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    motions = np.array([np.array(b.matrix @ b.bone.matrix_local.inverted()) for b in evaluated.pose.bones])
    heads = np.array([bone.head_local[:] for bone in armature.data.bones])
    tails = np.array([bone.tail_local[:] for bone in armature.data.bones])
    to_armature = np.array(armature.matrix_world.inverted() @ obj.matrix_world)

    def moved(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
        return points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]

    rest = scenes.rest_points(obj) if rest is None else rest
    of = (
        moved(to_armature, before),
        moved(to_armature, rest),
        *scenes.weights_of(obj),
        heads,
        tails,
        motions,
    )
    return moved(np.linalg.inv(to_armature), bulge_limit_reference.limit(*of, mask=mask, **options))


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


def test_a_vertex_group_says_where(route):
    obj, _before = bent_arm()
    group = obj.vertex_groups.new(name="where")
    for vertex in obj.data.vertices:
        if vertex.co.y > 0.0:
            group.add([vertex.index], 0.8, "REPLACE")
    bpy.context.scene.frame_set(10)
    before = scenes.final_points(obj)
    limit(obj, group="where")
    found = scenes.final_points(obj)
    obj.vertex_groups.remove(group)
    mask = np.where(scenes.rest_points(obj)[:, 1] > 0.0, 0.8, 0.0)
    expected = expected_points(obj, before, mask=mask)
    assert scenes.worst(found, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    np.testing.assert_array_equal(found[mask == 0.0], before[mask == 0.0])
    assert np.abs(found - before).max() > 0.005


def test_a_mesh_that_lies_elsewhere_and_moves(route):
    obj, armature = scenes.make_arm(bones=3)
    obj.location, obj.rotation_euler = (0.4, -1.0, 0.3), (0.2, 0.5, 0.1)
    armature.location = (1.0, 2.0, -0.5)
    for frame, height in ((8, 0.3), (11, 0.6)):
        obj.location.z = height
        obj.keyframe_insert("location", frame=frame)
    scenes.add_sinew(obj, "dq")
    before = dict(zip((8, 11), scenes.shapes(obj, [8, 11]), strict=True))
    limit(obj)
    for frame in (11, 8):
        bpy.context.scene.frame_set(frame)
        assert_limited(obj, before[frame])


def test_shape_keys_may_bulge(route):
    obj, _armature = scenes.make_arm(bones=3)
    scenes.key_shape(obj)
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(11)
    before = scenes.final_points(obj)
    limit(obj)
    # The key lifts all vertices by 0.2.
    assert_limited(obj, before, rest=scenes.rest_points(obj) + np.float32([0.0, 0.0, 0.2]))


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


def test_a_masked_modifier_leaves_its_vertices_alone():
    obj, _armature = scenes.make_arm(bones=3)
    group = obj.vertex_groups.new(name="mask")
    group.add([v.index for v in obj.data.vertices if v.co.x > 1.5], 1.0, "REPLACE")
    obj.modifiers["Armature"].vertex_group = "mask"
    scenes.add_sinew(obj, "dq")
    bpy.context.scene.frame_set(11)
    before = scenes.final_points(obj)
    limit(obj)
    found, still = scenes.final_points(obj), scenes.rest_points(obj)[:, 0] <= 1.5
    np.testing.assert_array_equal(found[still], scenes.rest_points(obj)[still])
    assert np.abs(found - before).max() > 0.005


def test_bendy_bones_are_limited_along_their_curve():
    obj, armature = scenes.make_arm(bones=2)
    armature.data.bones[0].bbone_segments = 4
    scenes.add_sinew(obj, "lbs")
    armature.pose.bones[0].bbone_curveoutx = 0.4
    bpy.context.scene.frame_set(11)
    before = scenes.final_points(obj)
    bones = session.state_of(obj).bound.first_deformer.bones
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
