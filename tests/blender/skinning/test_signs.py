# SPDX-License-Identifier: GPL-3.0-or-later
"""Signs of quaternions along the hierarchy: a chain that twists on beyond half a turn is not torn."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.deform import small_meshes

BONES, RADIUS = 6, 0.25
# At 60 degrees a bone, no two bones of a vertex are more than half a turn apart.
DEGREES = 60.0, 120.0, 170.0


def make_tentacle() -> tuple[bpy.types.Object, bpy.types.Object, np.ndarray]:
    """Returns an arm, its armature of bones that are one long, and its weights [vertices, bones]."""
    obj, armature = scenes.make_arm(bones=BONES, rings=20 * BONES + 1)
    scenes.forget_keys(armature)
    for bone in armature.pose.bones:
        bone.matrix_basis.identity()
    distance = np.abs(scenes.rest_points(obj)[:, :1] - np.arange(BONES) - 0.5) / 2
    weights = np.where(distance < 1, (1 - distance**2) ** 2, 0)
    weights /= weights.sum(axis=1, keepdims=True)
    obj.vertex_groups.clear()
    for bone, shares in zip(armature.data.bones, weights.T, strict=True):
        scenes.paint(obj, bone.name, shares)
    obj.modifiers["Armature"].use_deform_preserve_volume = True
    return obj, armature, weights


def twist(armature: bpy.types.Object, degrees: float) -> None:
    for bone in armature.pose.bones:
        bone.rotation_mode = "AXIS_ANGLE"
        bone.rotation_axis_angle = np.radians(degrees), 0, 1, 0
    bpy.context.view_layer.update()


def blended(points: np.ndarray, weights: np.ndarray, degrees: np.ndarray, method: str = "dq") -> np.ndarray:
    """What bones turned by angles [bones] about one axis make of points: by the normalised sum of
    quaternions, or, for dib, by the mean angle."""
    half = 0.5 * np.radians(degrees)
    angle = 2 * np.arctan2(weights @ np.sin(half), weights @ np.cos(half))
    if method == "dib":
        angle = 2 * weights @ half
    x, y, z = points.T
    return np.stack([x, y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)], axis=1)


def longest_edge(obj: bpy.types.Object, points: np.ndarray) -> float:
    """The largest ratio of an edge's length to that at rest."""
    edges = np.array([edge.vertices[:] for edge in obj.data.edges])
    rest = scenes.rest_points(obj)
    lengths = (np.linalg.norm(np.subtract(*p[edges].transpose(1, 0, 2)), axis=1) for p in (points, rest))
    return float(np.divide(*lengths).max())


@pytest.mark.parametrize("method", ["dq", "cor", "sbs", "dib"])
def test_turns_add_up_along_the_chain(method: str):
    obj, armature, weights = make_tentacle()
    by_modifier = {}
    for degrees in DEGREES:
        twist(armature, degrees)
        by_modifier[degrees] = scenes.final_points(obj)
    scenes.add_sinew(obj, method)
    settings = properties.of(obj)
    for degrees in DEGREES:
        twist(armature, degrees)
        getattr(settings, method).signs = "blender"
        bpy.context.view_layer.update()
        shorter = scenes.final_points(obj)
        if method != "dib":
            # About one axis all others give one shape.
            assert scenes.worst(shorter, by_modifier[degrees]) < 2e-6 * scenes.diagonal(obj)
        getattr(settings, method).signs = "hierarchy"
        bpy.context.view_layer.update()
        points = scenes.final_points(obj)
        turned = degrees * np.arange(1, BONES + 1)
        expected = blended(scenes.rest_points(obj).astype(float), weights, turned, method)
        assert scenes.worst(points, expected) < 4e-6 * scenes.diagonal(obj)
        if degrees == DEGREES[0]:
            assert scenes.worst(points, shorter) < 2e-6 * scenes.diagonal(obj)
        else:
            assert longest_edge(obj, points) < 1.5 < 3 < longest_edge(obj, shorter)


@pytest.mark.parametrize("mode", ["XYZ", "ZYX", "AXIS_ANGLE"])
@pytest.mark.parametrize("method", ["dq", "cor", "sbs", "dib"])
def test_one_joint_turns_as_far_as_its_channels_say(method: str, mode: str):
    obj, armature, weights = make_tentacle()
    scenes.add_sinew(obj, method)
    getattr(properties.of(obj), method).signs = "hierarchy"
    bone = armature.pose.bones[3]
    rest = scenes.rest_points(obj).astype(float)

    def pose(degrees: float) -> np.ndarray:
        bone.rotation_mode, angle = mode, np.radians(degrees)
        bone.rotation_euler = 0, angle, 0
        bone.rotation_axis_angle = angle, 0, 1, 0
        bpy.context.view_layer.update()
        return scenes.final_points(obj)

    for degrees in (100, 179, 180, 181, -180, 250, -300, 340):
        expected = blended(rest, weights, np.array([0, 0, 0, degrees, degrees, degrees]), method)
        assert scenes.worst(pose(degrees), expected) < 4e-6 * scenes.diagonal(obj), degrees
    # Something else turns the bone: nothing tells its turns.
    limit = bone.constraints.new("LIMIT_ROTATION")
    limit.use_limit_y, limit.max_y, limit.owner_space = True, np.radians(20), "LOCAL"
    expected = blended(rest, weights, np.array([0, 0, 0, 20, 20, 20]), method)
    assert scenes.worst(pose(-300), expected) < 4e-6 * scenes.diagonal(obj)


def test_the_speed_of_a_joint_that_turns_is_bounded():
    obj, armature, _weights = make_tentacle()
    scenes.add_sinew(obj, "dq")
    properties.of(obj).dq.signs = "hierarchy"
    armature.pose.bones[3].rotation_mode = "XYZ"
    shapes = []
    for degrees in range(-330, 331):
        armature.pose.bones[3].rotation_euler = 0, np.radians(degrees), 0
        bpy.context.view_layer.update()
        shapes.append(scenes.final_points(obj))
    # Between the bones a vertex is faster than the bone, the more the nearer this is to a whole turn.
    slow, all_speeds = (
        np.linalg.norm(np.diff(np.array(part), axis=0), axis=2).max() / (RADIUS * np.radians(1))
        for part in (shapes[150:-150], shapes)
    )
    assert slow < 1.1
    assert all_speeds < 4


def test_a_small_mesh_is_not_left_to_the_modifier(small_meshes_as_users_have_them, monkeypatch):
    monkeypatch.setattr(small_meshes, "is_used", True)
    obj, armature, _weights = make_tentacle()
    scenes.add_sinew(obj, "dq")
    settings = properties.of(obj)
    twist(armature, DEGREES[-1])
    shorter = scenes.final_points(obj)
    assert scenes.deformed_now(obj)[0][1].plan.uses_builtin
    settings.dq.signs = "hierarchy"
    bpy.context.view_layer.update()
    assert not scenes.deformed_now(obj)[0][1].plan.uses_builtin
    assert scenes.worst(scenes.final_points(obj), shorter) > 0.1


def test_the_rest_pose_and_a_turned_armature_change_nothing():
    obj, armature, _weights = make_tentacle()
    scenes.add_sinew(obj, "dq")
    properties.of(obj).dq.signs = "hierarchy"
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), scenes.rest_points(obj)) < 1e-6
    twist(armature, DEGREES[-1])
    before = scenes.final_points(obj)
    armature.pose.bones[0].rotation_axis_angle = np.radians(DEGREES[-1] + 200), 0, 1, 0
    bpy.context.view_layer.update()
    x, y, z = before.T
    c, s = np.cos(np.radians(200)), np.sin(np.radians(200))
    assert scenes.worst(scenes.final_points(obj), np.stack([x, c * y - s * z, s * y + c * z], axis=1)) < 1e-5
