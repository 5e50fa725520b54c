# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups read in bulk, compared with a loop over Blender's own collections."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from sinew_addon.io import mesh_io
from sinew_addon.skinning.influences import GroupWeights


def in_a_loop(mesh: bpy.types.Mesh) -> GroupWeights:
    entries = [[(entry.group, entry.weight) for entry in vertex.groups] for vertex in mesh.vertices]
    flat = [entry for of_vertex in entries for entry in of_vertex]
    return GroupWeights(
        np.array([len(of_vertex) for of_vertex in entries], dtype=np.int32),
        np.array([group for group, _weight in flat], dtype=np.int32),
        np.array([weight for _group, weight in flat], dtype=np.float32),
    )


def read_alike(mesh: bpy.types.Mesh) -> GroupWeights:
    """The result of mesh_io, which must equal that of the loop, bit for bit and type for type."""
    read, expected = mesh_io.read_group_weights(mesh), in_a_loop(mesh)
    for name in ("counts", "groups", "weights"):
        assert getattr(read, name).dtype == getattr(expected, name).dtype
    assert read.equals(expected)
    return read


def a_grid(side: int = 20) -> bpy.types.Object:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side)
    return bpy.context.object


def weigh_at_random(obj: bpy.types.Object, groups: int, seed: int) -> None:
    """Vertices with any number of groups in any order; one weight in five is zero."""
    random = np.random.default_rng(seed)
    made = [obj.vertex_groups.new(name=f"group {number}") for number in range(groups)]
    for vertex in range(len(obj.data.vertices)):
        for group in random.permutation(groups)[: random.integers(groups + 1)]:
            weight = 0.0 if random.random() < 0.2 else random.random(dtype=np.float32)
            made[group].add([vertex], float(weight), "REPLACE")


@pytest.mark.parametrize("seed", range(3))
def test_random_weights_are_read_as_they_are_stored(seed):
    obj = a_grid()
    weigh_at_random(obj, 7, seed)
    read = read_alike(obj.data)
    assert (read.counts == 0).any()
    assert (read.weights == 0.0).any()
    vertex_of = np.repeat(np.arange(len(read.counts)), read.counts)
    assert (np.diff(read.groups)[np.diff(vertex_of) == 0] < 0).any(), "in the order of the groups"


def test_meshes_of_all_kinds():
    """More groups than a deformer resolves at once, none, one that is gone; loose vertices, shape keys and
    layers; in edit mode; evaluated."""
    obj = a_grid(4)
    assert not read_alike(obj.data).counts.any()
    weigh_at_random(obj, 50, 1)
    assert read_alike(obj.data).counts.max() > 32
    obj.vertex_groups.remove(obj.vertex_groups[1])
    assert read_alike(obj.data).groups.max() == 48
    obj.data.vertices.add(3)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Key").value = 1.0
    obj.data.uv_layers.new(name="second")
    obj.data.attributes.new("number", "INT", "POINT")
    before = read_alike(obj.data)
    assert (before.counts[-3:] == 0).all()
    bpy.ops.object.mode_set(mode="EDIT")
    assert read_alike(obj.data).equals(before)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 2
    obj.modifiers.new("Mirror", "MIRROR")
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert len(read_alike(evaluated).counts) > len(obj.data.vertices)
    assert len(read_alike(bpy.data.meshes.new("nothing")).counts) == 0


@pytest.mark.parametrize("levels", [1, 3])
def test_no_bmesh_of_a_mesh_with_more_vertices_than_its_keys(monkeypatch, levels):
    """For an evaluated mesh whose modifiers made more vertices than its keys have: Blender reads garbage
    there, or crashes."""
    obj = a_grid()
    weigh_at_random(obj, 4, 5)
    obj.modifiers.new("Subdivision", "SUBSURF").levels = levels
    depsgraph = bpy.context.evaluated_depsgraph_get()
    expected = read_alike(obj.evaluated_get(depsgraph).data)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Key")
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    if evaluated.shape_keys is not None:
        monkeypatch.setattr(mesh_io, "bmesh", None)
    assert read_alike(evaluated).equals(expected)
    monkeypatch.undo()
    assert read_alike(obj.data).counts.shape == (len(obj.data.vertices),)
