# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex groups read in bulk, compared with a loop over Blender's own collections."""

from __future__ import annotations

import struct

import bpy
import numpy as np
import pytest
from sinew_addon.io import mesh_io, mesh_memory
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
def test_a_mesh_with_more_vertices_than_its_keys(levels):
    """An evaluated mesh whose modifiers made more vertices than its keys have."""
    obj = a_grid()
    weigh_at_random(obj, 4, 5)
    obj.modifiers.new("Subdivision", "SUBSURF").levels = levels
    depsgraph = bpy.context.evaluated_depsgraph_get()
    expected = read_alike(obj.evaluated_get(depsgraph).data)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Key")
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert read_alike(evaluated).equals(expected)
    assert read_alike(obj.data).counts.shape == (len(obj.data.vertices),)


def structures(catalogue: bytes, wanted: set[str]) -> dict[str, dict[str, int]]:
    """The offset of each field of structures, by their names, and as "" their sizes.

    catalogue  a blend file: its names, types, sizes and structures come in this order
    """
    start = catalogue.index(b"SDNANAME") + 4

    def strings(place: int) -> tuple[list[str], int]:
        (count,) = struct.unpack_from("=i", catalogue, place + 4)
        texts = catalogue[place + 8 :].split(b"\0", count)[:count]
        return [text.decode() for text in texts], aligned(place + 8 + sum(map(len, texts)) + count)

    def aligned(place: int) -> int:
        return place + (start - place) % 4

    names, place = strings(start)
    types, place = strings(place)
    sizes = struct.unpack_from(f"={len(types)}H", catalogue, place + 4)
    place = aligned(place + 4 + 2 * len(types))
    (count,) = struct.unpack_from("=i", catalogue, place + 4)
    place, found = place + 8, {}
    for _number in range(count):
        kind, length = struct.unpack_from("=2H", catalogue, place)
        fields, offset = struct.unpack_from(f"={2 * length}H", catalogue, place + 4), 0
        if types[kind] in wanted:
            own = found[types[kind]] = {"": sizes[kind]}
            for of, number in zip(fields[::2], fields[1::2], strict=True):
                name = names[number]
                own[name.partition("[")[0]] = offset
                of_one = 8 if name[0] in "*(" else sizes[of]
                offset += of_one * int(np.prod([int(part[:-1]) for part in name.split("[")[1:]]))
            assert offset == sizes[kind]
        place += 4 + 4 * length
    return found


def test_blender_keeps_groups_where_its_files_say(tmp_path):
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"), compress=False)
    wanted = {"Mesh", "CustomData", "CustomDataLayer", "MDeformVert", "MDeformWeight"}
    found = structures((tmp_path / "a.blend").read_bytes(), wanted)
    layer, own = found["CustomDataLayer"], found["CustomData"]
    offsets = mesh_memory.Offsets(found["Mesh"]["vdata"] + own["*layers"], layer["*data"], layer[""])
    assert mesh_memory.OFFSETS[bpy.app.version[:2]] == offsets
    assert own["totlayer"] - own["*layers"] == mesh_memory.LAYER_COUNT
    assert layer["type"] == 0
    vertex, entry = found["MDeformVert"], found["MDeformWeight"]
    assert (vertex["*dw"], vertex["totweight"], vertex[""]) == (0, 8, 16)
    assert (entry["def_nr"], entry["weight"], entry[""]) == (0, 4, 8)


def test_a_blender_whose_memory_is_not_known_is_read_vertex_by_vertex(monkeypatch):
    obj = a_grid(4)
    assert mesh_memory.address_of_groups(obj.data) == 0
    weigh_at_random(obj, 5, 1)
    assert mesh_memory.address_of_groups(obj.data) > 0
    monkeypatch.setattr(mesh_memory, "OFFSETS", {})
    assert mesh_memory.address_of_groups(obj.data) is None
    read_alike(obj.data)


def test_reading_copies_nothing():
    """A mesh shares its groups with its evaluated copy, until somebody looks at one vertex."""
    obj = a_grid(4)
    weigh_at_random(obj, 5, 1)
    bpy.context.view_layer.update()
    address = mesh_memory.address_of_groups(obj.data)
    mesh_io.read_group_weights(obj.data)
    assert mesh_memory.address_of_groups(obj.data) == address
