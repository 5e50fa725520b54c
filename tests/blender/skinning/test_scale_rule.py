# SPDX-License-Identifier: GPL-3.0-or-later
"""The three scale rules compared with the float64 reference, whose own rule is Blender 4.0's.

The rule of Blender 3 was also compared with Blender 3.4.1 itself: 60 random rigs with scaled and mirrored
bones under Preserve Volume; the largest difference was 1.3e-6 of the diagonal.
"""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import reference
import scenes
import sinew
from sinew_addon.attach import properties
from sinew_addon.deform import session

pytestmark = pytest.mark.long_term

RIGID_METHODS = [method.name for method in sinew.methods() if method.name != "lbs"]


def posed_arm(scaled: bool) -> bpy.types.Object:
    obj, armature = scenes.make_arm(bones=3)
    scenes.forget_keys(armature)
    for bone, degrees in ((0, 30.0), (1, -70.0), (2, 50.0)):
        scenes.bend(armature, degrees, bone)
    if scaled:
        armature.pose.bones[1].scale = (1.4, 0.7, 1.2)
        armature.pose.bones[2].scale = (-0.8, 1.1, 1.0)
    scenes.add_sinew(obj)
    return obj


def expected(obj: bpy.types.Object, method: str, rule: str) -> np.ndarray:
    deformer = session.skinned_of(obj).bound.first_deformer
    frame, rest = deformer.last_frame, deformer.bones.rest.astype(np.float64)
    influences = deformer.weighting.influences(deformer.rest_points)
    motions = frame.pose.astype(np.float64) @ np.linalg.inv(rest)
    rigid = np.tile(np.eye(4), (len(rest), 1, 1))
    for bone, motion in enumerate(motions):
        head = rest[bone, :3, 3]
        rigid[bone, :3, :3] = reference.rotation_of_bone(motion, rest[bone])
        rigid[bone, :3, 3] = (motion @ np.append(head, 1.0))[:3] - rigid[bone, :3, :3] @ head
    points = deformer.rest_points.astype(np.float64)
    bound = (influences.offsets, influences.bones, influences.weights)
    # Mesh and armature are in one space; for every rule, vertex data belongs to the mesh at rest.
    triangles = scenes.triangles_of(obj)
    kept = {}
    if method == "cor":
        kept[method] = sinew.centres_of_rotation(deformer.rest_points, *bound, triangles).result()
    elif method == "ddm":
        radius = properties.of(obj).ddm.radius
        kept[method] = sinew.direct_delta_mush(deformer.rest_points, *bound, triangles, radius).result()
    if rule == "3.x":
        points, _ = reference.deform("lbs", points, *bound, np.linalg.inv(rigid) @ motions)
    motions = motions if rule == "4.0" else rigid
    return reference.deform(method, points, *bound, motions, rest, kept)[0]


@pytest.mark.parametrize("rule", ["4.0", "3.x", "none"])
@pytest.mark.parametrize("method", RIGID_METHODS)
def test_against_reference(method, rule):
    obj = posed_arm(scaled=True)
    properties.of(obj).scale_rule = rule
    properties.of(obj).method = method
    got = scenes.final_points(obj)
    assert scenes.worst(got, expected(obj, method, rule)) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("method", RIGID_METHODS)
def test_rules_agree_to_the_bit_where_no_bone_is_scaled(method):
    obj = posed_arm(scaled=False)
    properties.of(obj).method = method
    shown = scenes.final_points(obj)
    for rule in ("3.x", "none"):
        properties.of(obj).scale_rule = rule
        assert np.array_equal(scenes.final_points(obj), shown)


def test_without_scale_linear_blend_moves_by_rigid_motions():
    obj = posed_arm(scaled=True)
    properties.of(obj).scale_rule = "none"
    assert scenes.worst(scenes.final_points(obj), expected(obj, "lbs", "none")) <= 1e-5


def test_a_frame_without_scale_after_one_with():
    obj = posed_arm(scaled=True)
    properties.of(obj).method, properties.of(obj).scale_rule = "dq", "3.x"
    for bone in properties.of(obj).armature.pose.bones:
        bone.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), expected(obj, "dq", "3.x")) <= 1e-5
