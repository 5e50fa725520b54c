# SPDX-License-Identifier: GPL-3.0-or-later
"""What was read before is returned itself where the mesh still has the same, and only there."""

from __future__ import annotations

from collections.abc import Callable

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from sinew_addon.deform import session, source
from sinew_addon.deform.source import Source


def move(mesh: bpy.types.Mesh) -> None:
    mesh.vertices[5].co.z += 0.25


def weigh(mesh: bpy.types.Mesh) -> None:
    mesh.vertices[5].groups[0].weight = 0.125


def swap_groups(mesh: bpy.types.Mesh) -> None:
    """The same entries in another order."""
    (first, weight), *_ = [(entry.group, entry.weight) for entry in mesh.vertices[5].groups]
    group = bpy.data.objects["Arm"].vertex_groups[first]
    group.remove([5])
    group.add([5], weight, "REPLACE")


def move_an_entry(mesh: bpy.types.Mesh) -> None:
    """The same entries in the same order, of other vertices."""
    group = bpy.data.objects["Arm"].vertex_groups[0]
    for vertex in mesh.vertices:
        group.remove([vertex.index])
    group.add([6], 1.0, "REPLACE")


def take_all_weights(mesh: bpy.types.Mesh) -> None:
    bpy.data.objects["Arm"].vertex_groups.clear()


def sharpen(mesh: bpy.types.Mesh) -> None:
    mesh.edges[3].use_edge_sharp = True


def flatten(mesh: bpy.types.Mesh) -> None:
    mesh.polygons[3].use_smooth = False


def turn_normals(mesh: bpy.types.Mesh) -> None:
    mesh.normals_split_custom_set([(0.0, 0.6, 0.8)] * len(mesh.loops))


def flip(mesh: bpy.types.Mesh) -> None:
    mesh.polygons[3].flip()


def turn_a_quad(mesh: bpy.types.Mesh) -> None:
    """Other edges among the same vertices, as many as before."""
    edited = bmesh.new()
    edited.from_mesh(mesh)
    edited.faces.ensure_lookup_table()
    pair = bmesh.ops.triangulate(edited, faces=edited.faces[:1])["edges"]
    bmesh.ops.rotate_edges(edited, edges=pair)
    edited.to_mesh(mesh)
    edited.free()


def key_a_vertex(mesh: bpy.types.Mesh) -> None:
    mesh.shape_keys.key_blocks["Fat"].points[5].co.x += 0.25


def key_the_basis(mesh: bpy.types.Mesh) -> None:
    mesh.shape_keys.reference_key.points[5].co.x += 0.25


def mask_a_key(mesh: bpy.types.Mesh) -> None:
    mesh.shape_keys.key_blocks["Fat"].vertex_group = "bone.1"


def relate_a_key(mesh: bpy.types.Mesh) -> None:
    blocks = mesh.shape_keys.key_blocks
    blocks["Fat"].relative_key = blocks["Tall"]


EDITS = {
    move: {"points", "mesh_points"},
    weigh: {"weights"},
    swap_groups: {"weights"},
    move_an_entry: {"weights"},
    take_all_weights: {"weights"},
    sharpen: {"shading"},
    flatten: {"shading"},
    turn_normals: {"shading"},
    flip: {"topology"},
    key_a_vertex: {"shape_keys"},
    key_the_basis: {"shape_keys"},
    mask_a_key: {"shape_keys"},
    relate_a_key: {"shape_keys"},
    turn_a_quad: {"topology", "triangles"},
}
ARRAYS = ("weights", "points", "mesh_points", "topology", "shading", "shape_keys", "triangles")


@pytest.fixture
def arm() -> bpy.types.Object:
    obj, _armature = scenes.make_arm()
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Fat").points[30].co.z += 0.2
    obj.shape_key_add(name="Tall").points[8].co.z += 0.2
    for group, weight in zip(obj.vertex_groups, (0.3, 0.7), strict=True):
        group.add([5], weight, "REPLACE")
    scenes.add_sinew(obj, "dq")
    return obj


def read(obj: bpy.types.Object, known: Source | None = None, with_surface: bool = True) -> Source:
    return source.read(obj, bpy.context.evaluated_depsgraph_get(), with_surface, known)


def test_a_mesh_that_was_not_changed_is_known(arm):
    known = read(arm)
    assert read(arm, known) is known
    bpy.context.scene.frame_set(7)
    assert read(arm, known) is known


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.__name__)
def test_only_what_was_changed_is_new(arm, edit: Callable[[bpy.types.Mesh], None]):
    known = read(arm)
    edit(arm.data)
    now, expected = read(arm, known), read(arm)
    assert now.equals(expected)
    new = {name for name in ARRAYS if getattr(now, name) is not getattr(known, name)}
    # Before 4.5, custom normals are left to Blender.
    changed = set() if edit is turn_normals and bpy.app.version < (4, 5) else EDITS[edit]
    assert changed <= new <= {*changed, "triangles"}


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.__name__)
def test_an_edit_together_with_a_choice_is_seen(arm, edit: Callable[[bpy.types.Mesh], None]):
    """Blender lists the mesh for either."""
    arm.sinew.method = "qv"
    edit(arm.data)
    arm.data.update()
    bpy.context.view_layer.update()
    assert session.skinned_of(arm).bound.source.equals(read(arm, with_surface=False))


def test_what_cannot_be_computed_with_counts_as_known(arm):
    arm.shape_key_clear()
    arm.data.vertices[5].co.z = np.nan
    arm.data.update()
    bpy.context.view_layer.update()
    known = read(arm)
    assert np.isfinite(known.points).all()
    assert read(arm, known) is known
