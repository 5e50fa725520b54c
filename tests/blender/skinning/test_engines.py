# SPDX-License-Identifier: GPL-3.0-or-later
"""What engines make of a skin, shown live: the Armature modifier's shape after weights were really cut."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import properties
from sinew_addon.io import armature_io
from sinew_addon.skinning import engines

FRAME = 8


def make_crowded() -> tuple[bpy.types.Object, bpy.types.Object]:
    """An arm whose every vertex follows all of its bones."""
    obj, armature = scenes.make_arm(bones=10)
    rng = np.random.default_rng(5)
    for group in obj.vertex_groups:
        for vertex in range(len(obj.data.vertices)):
            group.add([vertex], float(rng.uniform(0.0005, 1.0) ** 3), "REPLACE")
    return obj, armature


def cut(obj: bpy.types.Object, most: int, least: float, levels: int) -> None:
    """Does to the mesh's groups what an importer does, one vertex at a time."""
    for vertex in obj.data.vertices:
        pairs = sorted(((each.weight, -k, each.group) for k, each in enumerate(vertex.groups)), reverse=True)
        total = sum(weight for weight, _k, _group in pairs)
        kept = [(weight / total, group) for weight, _k, group in pairs][:most]
        kept = [kept[0], *(pair for pair in kept[1:] if pair[0] >= least)]
        total = sum(weight for weight, _group in kept)
        kept = [(weight / total, group) for weight, group in kept]
        if levels:
            whole = [round(weight * levels) for weight, _group in kept]
            whole[0] += levels - sum(whole)
            kept = [(count / levels, group) for count, (_w, group) in zip(whole, kept, strict=True)]
        for group in obj.vertex_groups:
            group.remove([vertex.index])
        for weight, group in kept:
            obj.vertex_groups[group].add([vertex.index], weight, "REPLACE")


@pytest.mark.parametrize("name", engines.ENGINES)
def test_it_is_the_shape_after_the_import(name, route):
    engine = engines.ENGINES[name]
    most = 2 if engine.parameters else engine.influences
    obj, _armature = make_crowded()
    cut(obj, most, engine.least, engine.levels)
    expected = scenes.modifier_shapes(obj, [FRAME], False)[0]
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj, _armature = make_crowded()
    whole = scenes.modifier_shapes(obj, [FRAME], False)[0]
    weights = [[(g.group, g.weight) for g in v.groups] for v in obj.data.vertices]
    scenes.add_sinew(obj, "dq")
    properties.of(obj).twist_spread.enabled = properties.of(obj).bulge_limit.enabled = True
    properties.of(obj).limited.influences = 2
    properties.of(obj).method = name
    bpy.context.scene.frame_set(FRAME)
    points = scenes.final_points(obj)
    assert scenes.worst(points, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    assert scenes.worst(points, whole) > 10 * scenes.TOLERANCE * scenes.diagonal(obj)
    assert weights == [[(g.group, g.weight) for g in v.groups] for v in obj.data.vertices]
    properties.of(obj).method = "lbs"
    properties.of(obj).twist_spread.enabled = properties.of(obj).bulge_limit.enabled = False
    bpy.context.view_layer.update()
    assert scenes.worst(scenes.final_points(obj), whole) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_how_many_can_be_keyed():
    obj, _armature = make_crowded()
    scenes.add_sinew(obj, "limited")
    keys = ((1, 1), (10, 8))
    scenes.key(properties.of(obj).limited, "influences", keys)
    for frame, count in keys:
        bpy.context.scene.frame_set(frame)
        points = scenes.final_points(obj)
        reference, _other = make_crowded()
        reference.name = "Reference"
        cut(reference, count, 0.0, 0)
        expected = scenes.modifier_shapes(reference, [frame], False)[0]
        assert scenes.worst(points, expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
        bpy.data.objects.remove(reference)


def test_bendy_bones_are_straight(route):
    obj, armature = scenes.make_arm(bones=3)
    expected = scenes.modifier_shapes(obj, [FRAME], False)[0]
    armature.data.bones[1].bbone_segments = 4
    bent = scenes.modifier_shapes(obj, [FRAME], False)[0]
    assert scenes.worst(bent, expected) > 1e-3
    scenes.add_sinew(obj, "gltf")
    bpy.context.scene.frame_set(FRAME)
    assert scenes.worst(scenes.final_points(obj), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_shear_is_lost_as_exporters_lose_it():
    """A bone that takes no scale from a parent that is scaled along one axis has shear against it."""
    _obj, armature = scenes.make_arm(bones=3)
    first, second = armature.pose.bones[0], armature.pose.bones[1]
    for bone in (first, second):
        bone.rotation_mode = "XYZ"
    first.scale = 1.0, 2.5, 1.0
    second.rotation_euler.x = 0.9
    armature.data.bones[1].inherit_scale = "NONE"
    bpy.context.view_layer.update()
    pose = np.array([bone.matrix for bone in armature.pose.bones], np.float32)
    parents = np.array([-1, 0, 1], np.int32)
    found = armature_io.decomposed(pose, parents)
    above = None
    for number, bone in enumerate(armature.pose.bones):
        local = bone.matrix if above is None else bone.parent.matrix.inverted() @ bone.matrix
        place, turn, scale = local.decompose()
        own = type(local).LocRotScale(place, turn, scale)
        above = own if above is None else above @ own
        np.testing.assert_allclose(found[number], np.array(above), atol=1e-5)
    assert np.abs(found - pose).max() > 0.1
    unsheared = np.tile(np.identity(4, np.float32), (3, 1, 1))
    assert armature_io.decomposed(unsheared, parents) is unsheared
