# SPDX-License-Identifier: GPL-3.0-or-later
"""sinew.Normals compared with Blender's own normals of the same points."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import scenes
import sinew
from sinew_addon.io import mesh_io

# In each component.
NEAR = 1e-4
COLLECTIONS = {"vertex": "vertex_normals", "corner": "corner_normals", "face": "polygon_normals"}
DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face"}


def flags_of(collection: bpy.types.bpy_prop_collection, name: str) -> np.ndarray:
    flags = np.empty(len(collection), bool)
    collection.foreach_get(name, flags)
    return flags


def custom_of(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """int16 [corners, 2]; 4.2 can not read these."""
    attribute = mesh.attributes.get("custom_normal")
    if attribute is None:
        return None
    numbers = np.empty((len(attribute.data), 2), np.int32)
    attribute.data.foreach_get("value", numbers.ravel())
    return numbers


def normals_of(mesh: bpy.types.Mesh) -> sinew.Normals:
    topology = mesh_io.read_topology(mesh)
    return sinew.Normals(
        len(mesh.vertices),
        topology.face_offsets,
        topology.corner_vertices,
        topology.edges,
        sharp_edges=flags_of(mesh.edges, "use_edge_sharp"),
        sharp_faces=~flags_of(mesh.polygons, "use_smooth"),
        custom_normals=custom_of(mesh),
    )


def by_blender(mesh: bpy.types.Mesh, domain: str) -> np.ndarray:
    return scenes.points_of(getattr(mesh, COLLECTIONS[domain]), "vector")


def give_points(mesh: bpy.types.Mesh, points: np.ndarray) -> None:
    mesh.vertices.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())
    mesh.update()


def assert_as_blender(mesh: bpy.types.Mesh) -> None:
    """Compares every domain, with the object's points.

    With custom normals of corners, Blender uses their mean for each vertex and face.
    """
    normals = normals_of(mesh)
    points = mesh_io.read_points(mesh)
    assert normals.domain == DOMAINS[mesh.normals_domain]
    for domain in ("corner",) if mesh.has_custom_normals else COLLECTIONS:
        got, expected = normals.compute(points, domain), by_blender(mesh, domain)
        assert np.isfinite(got).all()
        np.testing.assert_allclose(got, expected, rtol=0, atol=NEAR, err_msg=domain)


def make_mesh(points: np.ndarray, faces: list[list[int]], edges: list[tuple] = ()) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(np.asarray(points).tolist(), list(edges), faces)
    mesh.shade_smooth()
    return mesh


def random_mesh(seed: int) -> bpy.types.Mesh:
    """Triangles, quads and larger polygons, some of them flipped, with holes, edges of three faces, and
    edges and vertices without faces."""
    rng, size = np.random.default_rng(seed), 22
    x, y = np.mgrid[:size, :size]
    points = np.stack([x, y, rng.normal(size=x.shape)], axis=-1).reshape(-1, 3)
    points = list(points + rng.normal(0, 0.2, points.shape))
    faces = []
    for a in range(size * (size - 1)):
        if a % size == size - 1:
            continue
        b, c, d = a + size, a + size + 1, a + 1
        kind = rng.integers(12)
        if kind == 1:
            faces += [[a, b, c], [a, c, d]]
        elif kind == 2:
            faces.append([d, c, b, a])
        elif kind == 3:
            points.append(rng.normal(0, size, 3))
            faces += [[a, b, c, d], [a, b, len(points) - 1]]
        elif kind == 4:
            ring = np.linspace(0, 6, int(rng.choice([*range(3, 15), 30, 31, 66])))
            first = len(points)
            points += list(np.stack([np.cos(ring), np.sin(ring), rng.normal(size=len(ring))], axis=1))
            faces.append([a, b, *range(first, len(points)), c, d])
        elif kind > 4:
            faces.append([a, b, c, d])
    points += [rng.normal(0, size, 3), np.zeros(3), rng.normal(0, size, 3)]
    return make_mesh(points, faces, [(len(points) - 3, 0)])


def mark(mesh: bpy.types.Mesh, edges: float, faces: float, seed: int = 1) -> None:
    """Makes these shares of them sharp."""
    rng = np.random.default_rng(seed)
    mesh.edges.foreach_set("use_edge_sharp", rng.random(len(mesh.edges)) < edges)
    mesh.polygons.foreach_set("use_smooth", rng.random(len(mesh.polygons)) >= faces)
    mesh.update()


@pytest.mark.parametrize(
    "share", [(0, 0), (0.02, 0), (0.3, 0), (0, 0.1), (0.2, 0.3), (1, 0), (0, 1)], ids=str
)
def test_random_meshes(share):
    for seed in range(3):
        mesh = random_mesh(seed)
        mark(mesh, *share)
        assert_as_blender(mesh)


def tilt(mesh: bpy.types.Mesh, by: float) -> None:
    """Gives it custom normals: its own, mixed with random ones."""
    rng = np.random.default_rng(2)
    normals = by_blender(mesh, "corner")
    normals = normals + by * rng.normal(size=normals.shape)
    mesh.normals_split_custom_set((normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist())
    mesh.update()


needs_stored = pytest.mark.skipif(bpy.app.version < (4, 5), reason="custom normals can not be read")


@needs_stored
@pytest.mark.parametrize("share", [(0, 0), (0.3, 0), (0.2, 0.3), (0, 1)], ids=str)
def test_custom_normals(share):
    for seed in range(3):
        mesh = random_mesh(seed)
        mark(mesh, *share)
        tilt(mesh, 0.5)
        assert_as_blender(mesh)
        # Values as they are stored for no normals, different ones within a fan, and some 0.
        rng = np.random.default_rng(seed)
        numbers = rng.integers(-32767, 32768, (len(mesh.loops), 2)) * (rng.random((len(mesh.loops), 2)) < 0.7)
        for value, stored in zip(numbers.tolist(), mesh.attributes["custom_normal"].data, strict=True):
            stored.value = value
        mesh.update()
        assert_as_blender(mesh)
        points = mesh_io.read_points(mesh)
        give_points(mesh, points + rng.normal(0, 0.3, points.shape))
        assert_as_blender(mesh)


def degenerate(points: np.ndarray, faces: np.ndarray, seed: int) -> np.ndarray:
    """With duplicate vertices, faces collapsed to a point or a line, and needles."""
    rng = np.random.default_rng(seed)
    points = points.copy()
    some = [faces[i] for i in rng.integers(len(faces), size=5 * (1 + len(faces) // 40))]
    for number, face in enumerate(some):
        start, along = points[face[0]].copy(), rng.normal(size=3)
        if number % 5 == 0:
            points[face[1]] = start
        elif number % 5 == 1:
            points[face] = start
        elif number % 5 == 2:
            points[face] = start + rng.random((len(face), 1)) * along
        elif number % 5 == 3:
            points[face] = start + np.linspace(0, 1, len(face))[:, None] * along + 1e-6 * rng.normal(size=3)
        else:
            points[face] = start + rng.normal(0, 1e-7, (len(face), 3))
    return points


@pytest.mark.parametrize("share", [(0, 0), (0.2, 0.1)], ids=str)
def test_degenerate_faces(share):
    for seed in range(4):
        mesh = random_mesh(seed)
        faces = [list(face.vertices) for face in mesh.polygons]
        give_points(mesh, degenerate(mesh_io.read_points(mesh), faces, seed))
        mark(mesh, *share)
        assert_as_blender(mesh)
        if bpy.app.version >= (4, 5):
            tilt(mesh, 0.2)
            assert_as_blender(mesh)


def test_faces_that_cancel_and_sizes_at_the_limits():
    flat = np.array([[2, 0, 0], [3, 0, 0], [2, 1, 0], [2, 1, 0]], float)
    folded = make_mesh(flat, [[0, 1, 2], [1, 0, 3]])
    for scale in (1.0, 1e-8, 2e-9, 1e-10, 1e-18, 1e8):
        give_points(folded, flat * scale)
        assert_as_blender(folded)
