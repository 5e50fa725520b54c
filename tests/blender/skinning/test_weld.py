# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are split at their seams: what smooths over the surface moves them as if they were whole."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.attach import attach, properties

FRAME = 11


def split(obj: bpy.types.Object) -> np.ndarray:
    """Splits the mesh at every face. Returns the vertex that each vertex was before."""
    before = scenes.rest_points(obj)
    made = bmesh.new()
    made.from_mesh(obj.data)
    bmesh.ops.split_edges(made, edges=made.edges)
    made.to_mesh(obj.data)
    made.free()
    after = scenes.rest_points(obj)
    return np.array([int(np.abs(before - point).sum(axis=1).argmin()) for point in after])


def shape(obj: bpy.types.Object, method: str, stage: dict[str, object]) -> np.ndarray:
    attach.remove(obj)
    scenes.add_sinew(obj, method)
    settings = properties.of(obj)
    settings.delta_mush.enabled = bool(stage)
    for name, value in stage.items():
        setattr(settings.delta_mush, name, value)
    settings.ddm.radius = 0.2
    bpy.context.scene.frame_set(FRAME)
    return scenes.final_points(obj)


CASES = [
    ("lbs", {"iterations": 20}),
    ("dq", {"radius": 0.1, "smooth_type": "length_weighted", "pin_boundary": True}),
    ("ddm", {}),
    ("cor", {}),
]


@pytest.mark.parametrize(("method", "stage"), CASES)
def test_a_mesh_that_is_split_at_every_face_moves_like_the_whole_one(method, stage, route):
    obj, _armature = scenes.make_arm(weights="rigid" if method != "cor" else "smooth")
    whole = shape(obj, method, stage)
    attach.remove(obj)
    before = split(obj)
    assert len(before) > 3 * len(whole)
    assert scenes.worst(shape(obj, method, stage), whole[before]) <= 1e-6 * scenes.diagonal(obj)


def test_without_a_weld_seams_are_edges():
    """Blender's own Corrective Smooth knows no weld, so what takes it over has none either."""
    obj, _armature = scenes.make_arm(weights="rigid")
    split(obj)
    modifier = obj.modifiers.new("Smooth", "CORRECTIVE_SMOOTH")
    modifier.iterations = 4
    bpy.context.scene.frame_set(FRAME)
    expected = scenes.final_points(obj)
    scenes.add_sinew(obj, "lbs")
    assert bpy.ops.sinew.take_over_smooth(name=obj.name) == {"FINISHED"}
    assert not properties.of(obj).delta_mush.weld
    assert scenes.worst(scenes.final_points(obj), expected) <= scenes.TOLERANCE * scenes.diagonal(obj)
    properties.of(obj).delta_mush.weld = True
    assert scenes.worst(scenes.final_points(obj), expected) > 1e-2 * scenes.diagonal(obj)


def test_lips_that_touch_at_rest_open():
    """Vertices at one place are not one where bones or keys move them apart."""
    obj, _armature = scenes.make_arm(weights="rigid")
    before = split(obj)
    doubles = np.flatnonzero(np.bincount(before)[before] > 1)
    lip = [int(v) for v in np.flatnonzero(before == before[doubles[0]])]
    obj.vertex_groups["bone.0"].remove([lip[0]])
    obj.vertex_groups["bone.1"].add([lip[0]], 1.0, "REPLACE")
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="open")
    key.data[lip[1]].co.z += 0.5
    key.value = 1.0
    points = shape(obj, "lbs", {"iterations": 3})
    assert np.linalg.norm(points[lip[1]] - points[lip[2]]) == pytest.approx(0.5, abs=1e-4)
    assert np.linalg.norm(points[lip[0]] - points[lip[2]]) > 1e-3
