# SPDX-License-Identifier: GPL-3.0-or-later
"""Spherical deform of models stored by mmd_tools, with the shape keys of sdef.KEYS."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import reference
import routes
import scenes
from sinew_addon.attach import attach
from sinew_addon.deform import session, survey
from sinew_addon.skinning import sdef

pytestmark = pytest.mark.long_term


def make_model() -> tuple[bpy.types.Object, bpy.types.Object]:
    """An arm whose vertices of two bones are spherical, except every seventh. For every third the groups
    are stored in reverse order."""
    obj, armature = scenes.make_arm(bones=3)
    scenes.add_spheres(
        obj, [v.index for v in obj.data.vertices if len(v.groups) == 2 and v.index % 7], seed=1
    )
    for vertex in obj.data.vertices:
        entries = [(entry.group, entry.weight) for entry in vertex.groups]
        if len(entries) == 2 and vertex.index % 3 == 0:
            (first, weight), _second = entries
            obj.vertex_groups[first].remove([vertex.index])
            obj.vertex_groups[first].add([vertex.index], weight, "REPLACE")
    assert any(v.groups[0].group > v.groups[1].group for v in obj.data.vertices if len(v.groups) == 2)
    return obj, armature


def expected_points(obj: bpy.types.Object, rest: np.ndarray | None = None) -> np.ndarray:
    """mmd_tools' formula in float64, vertex by vertex, with groups ordered by their index.

    rest  float [vertices, 3], the vertices after shape keys; None: the mesh's
    """
    armature = attach.armature_of(obj)
    matrices = dict(zip(armature.data.bones.keys(), scenes.bone_motions(armature), strict=True))
    to_armature = np.array(armature.matrix_world.inverted() @ obj.matrix_world)
    blocks = obj.data.shape_keys.key_blocks if obj.data.shape_keys else {}
    keys = [blocks[name] for name in sdef.KEYS if name in blocks]
    result = []
    for vertex in obj.data.vertices:
        basis = np.array(vertex.co if rest is None else rest[vertex.index], np.float64)
        point = moved(to_armature, basis)
        entries = sorted((entry.group, entry.weight) for entry in vertex.groups if entry.weight > 0.0)
        motions = [matrices[obj.vertex_groups[group].name] for group, _weight in entries]
        weights = np.array([weight for _group, weight in entries]) / sum(weight for _group, weight in entries)
        is_spherical = len(keys) == 3 and keys[0].data[vertex.index].co != vertex.co and len(entries) == 2
        if is_spherical:
            c, r0, r1 = (moved(to_armature, np.array(key.data[vertex.index].co)) for key in keys)
            mean = weights[0] * r0 + weights[1] * r1
            quaternions = [reference.skin.quaternion(motion[:3, :3]) for motion in motions]
            if quaternions[0] @ quaternions[1] < 0.0:
                quaternions[1] = -quaternions[1]
            blended = weights @ np.array(quaternions)
            at = reference.methods.rotation_of(blended) @ (point - c)
            for weight, motion, end in zip(weights, motions, (r0, r1), strict=True):
                at += weight * moved(motion, (c + (c + end - mean)) / 2.0)
        else:
            at = sum(w * moved(motion, point) for w, motion in zip(weights, motions, strict=True))
        result.append(moved(np.linalg.inv(to_armature), at))
    return np.array(result)


def moved(matrix: np.ndarray, point: np.ndarray) -> np.ndarray:
    return matrix[:3, :3] @ point + matrix[:3, 3]


def assert_as_expected(obj: bpy.types.Object, rest: np.ndarray | None = None) -> None:
    worst = scenes.worst(scenes.final_points(obj), expected_points(obj, rest))
    assert worst <= 2 * scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_model_has_the_shape_of_mmd_tools(route):
    obj, _armature = make_model()
    linear = scenes.modifier_shapes(obj, [8], preserve_volume=False)[0]
    scenes.add_sinew(obj, "sdef")
    for frame in (3, 8, 11):
        bpy.context.scene.frame_set(frame)
        assert routes.taken(obj, 0) == route
        assert_as_expected(obj)
    bpy.context.scene.frame_set(8)
    assert scenes.worst(scenes.final_points(obj), linear) > 0.02
    assert session.skinned_of(obj).bound.lacks(["sdef"]) == []


def test_a_model_that_lies_elsewhere(route):
    obj, armature = make_model()
    obj.location, obj.rotation_euler = (0.4, -1.0, 0.3), (0.2, 0.5, 0.1)
    armature.location = (1.0, 2.0, -0.5)
    bpy.context.view_layer.update()
    scenes.add_sinew(obj, "sdef")
    bpy.context.scene.frame_set(8)
    assert_as_expected(obj)


def test_morphs_move_vertices_and_not_their_spheres(route):
    obj, _armature = make_model()
    morph = obj.shape_key_add(name="smile")
    for point in morph.data:
        point.co.z += 0.1
    morph.value = 0.7
    scenes.add_sinew(obj, "sdef")
    bpy.context.scene.frame_set(8)
    assert_as_expected(obj, scenes.rest_points(obj) + np.float32([0.0, 0.0, 0.07]))


def test_without_the_keys_all_is_linear_and_the_panel_says_so(route):
    obj, _armature = scenes.make_arm(bones=3)
    linear = scenes.modifier_shapes(obj, [8], preserve_volume=False)[0]
    scenes.add_sinew(obj, "sdef")
    bpy.context.scene.frame_set(8)
    assert scenes.worst(scenes.final_points(obj), linear) <= scenes.TOLERANCE * scenes.diagonal(obj)
    bound = session.skinned_of(obj).bound
    assert bound.lacks(["dq", "sdef"]) == [sdef.LACKS_KEYS]
    assert bound.lacks(["dq", "off"]) == []


def test_keys_that_change_or_come_are_read_again(route):
    obj, _armature = make_model()
    scenes.add_sinew(obj, "sdef")
    bpy.context.scene.frame_set(8)
    before = scenes.final_points(obj)
    for point in obj.data.shape_keys.key_blocks[sdef.KEYS[0]].data:
        point.co.y += 0.1
    obj.data.update()
    bpy.context.scene.frame_set(9)
    bpy.context.scene.frame_set(8)
    assert_as_expected(obj)
    assert scenes.worst(scenes.final_points(obj), before) > 0.01
    obj.shape_key_clear()
    bpy.context.scene.frame_set(9)
    assert_as_expected(obj)
    assert session.skinned_of(obj).bound.lacks(["sdef"]) == [sdef.LACKS_KEYS]


def test_that_mmd_tools_deforms_it_too_is_said():
    """Once bound, it masks the Armature modifier and deforms the rest by a shape key with a driver."""
    obj = make_model()[0]
    scenes.add_sinew(obj, "sdef")
    key = obj.shape_key_add(name="mmd_sdef_skinning", from_mix=False)
    scenes.rebind(obj)
    assert any("unbind its SDEF" in text for text in survey.facts_of(obj, session.skinned_of(obj)).warnings)
    key.mute = True
    scenes.rebind(obj)
    assert not any("unbind" in text for text in survey.facts_of(obj, session.skinned_of(obj)).warnings)
