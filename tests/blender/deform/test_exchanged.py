# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh, or an armature's bones, that another add-on's handler exchanges without any sign from Blender, as
Keymesh does."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach

FRAMES = (5, 6, 7, 3)


def other_mesh(obj, vertices_too=False):
    """A thicker one; with other weights, and on demand with other vertices."""
    if vertices_too:
        other, rig = scenes.make_arm(sides=9, name="Other")
        mesh = other.data
        bpy.data.objects.remove(other)
        bpy.data.objects.remove(rig)
    else:
        mesh = obj.data.copy()
        for vertex in mesh.vertices:
            for entry in vertex.groups:
                entry.weight *= 0.5 if entry.group else 1.0
    for vertex in mesh.vertices:
        vertex.co.y *= 3.0
    for block in mesh.shape_keys.key_blocks if mesh.shape_keys is not None else ():
        for point in block.points:
            point.co.y *= 3.0
    return mesh


def plain(_obj):
    pass


def with_a_key(obj):
    scenes.key_shape(obj)
    obj.data.shape_keys.animation_data_clear()


def subdivided(obj):
    scenes.put_in_front(obj)


def displaced(obj):
    scenes.put_in_front(obj, "DISPLACE").strength = 0.1


def exchanges(obj, by_frame, use):
    def exchange(scene, *_):
        wanted = by_frame[scene.frame_current >= 6]
        if getattr(obj, use) != wanted:
            setattr(obj, use, wanted)

    return exchange


def shown(obj, event, exchange, first):
    with scenes.handler(event, exchange, first):
        return [scenes.shapes(obj, [frame])[0] for frame in FRAMES]


def assert_alike(obj, event, exchange, first, before):
    expected = shown(obj, event, exchange, first)
    obj.data = before
    bpy.context.scene.frame_set(1)
    scenes.add_sinew(obj)
    got = shown(obj, event, exchange, first)
    for frame, mine, its in zip(FRAMES, got, expected, strict=True):
        assert mine.shape == its.shape, frame
        assert scenes.worst(mine, its) <= scenes.TOLERANCE * scenes.diagonal(obj), frame


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("first", [False, True], ids=["behind Sinew's", "before Sinew's"])
@pytest.mark.parametrize("vertices_too", [False, True], ids=["same vertices", "other vertices"])
@pytest.mark.parametrize("prepare", [plain, with_a_key, subdivided, displaced])
def test_a_mesh_exchanged_by_a_handler(prepare, vertices_too, first):
    obj, _armature = scenes.make_arm()
    prepare(obj)
    meshes = obj.data, other_mesh(obj, vertices_too)
    exchange = exchanges(obj, meshes, "data")
    assert_alike(obj, "frame_change_post", exchange, first, meshes[0])


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("event", ["frame_change_pre", "frame_change_post"])
def test_a_mesh_exchanged_on_a_still_pose(event):
    obj, armature = scenes.make_arm()
    bpy.context.scene.frame_set(11)
    armature.animation_data_clear()
    meshes = obj.data, other_mesh(obj)
    assert_alike(obj, event, exchanges(obj, meshes, "data"), True, meshes[0])


@pytest.mark.usefixtures("route")
@pytest.mark.parametrize("first", [False, True])
def test_a_mesh_exchanged_in_a_render(rendered_points, first):
    obj, _armature = scenes.make_arm()
    meshes = obj.data, other_mesh(obj)
    exchange = exchanges(obj, meshes, "data")

    def rendered():
        found = []
        with scenes.handler("frame_change_post", exchange, first):
            for frame in (5, 6):
                bpy.context.scene.frame_set(1)
                bpy.context.scene.frame_current = frame
                found.append(rendered_points(obj))
        return np.array(found)

    expected = rendered()
    obj.data = meshes[0]
    scenes.add_sinew(obj)
    assert scenes.worst(rendered(), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)


@pytest.mark.parametrize("first", [False, True])
def test_bones_exchanged_by_a_handler(first):
    """After the update what handlers pose is there at the next event alone."""
    obj, armature = scenes.make_arm()
    other = armature.data.copy()
    bpy.context.scene.frame_set(1)
    armature.data = other
    scenes.enter(armature, "EDIT")
    other.edit_bones["bone.1"].head.y += 0.3
    other.edit_bones["bone.1"].tail.y += 0.1
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data, both = bpy.data.armatures["Arm Rig"], (bpy.data.armatures["Arm Rig"], other)
    exchange = exchanges(armature, both, "data")
    expected = shown(obj, "frame_change_post", exchange, first)
    armature.data = both[0]
    bpy.context.scene.frame_set(1)
    scenes.add_sinew(obj)
    got = shown(obj, "frame_change_post", exchange, first)
    assert scenes.worst(np.array(got), np.array(expected)) <= scenes.TOLERANCE * scenes.diagonal(obj)


def test_a_mesh_exchanged_by_a_script():
    obj, _armature = scenes.skinned_arm()
    bpy.context.scene.frame_set(8)
    obj.data = other_mesh(obj)
    bpy.context.view_layer.update()
    shown_now = scenes.final_points(obj)
    attach.remove(obj)
    assert scenes.worst(shown_now, scenes.final_points(obj)) <= scenes.TOLERANCE * scenes.diagonal(obj)
