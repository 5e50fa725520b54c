# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sinew.Normals: compared with float64 numpy."""

import numpy as np
import pytest
import sinew
from test_delta_mush import arrays_of, bent, mesh_of


def sharp_of(mesh, edges=0.2, faces=0.1, seed=3):
    """{argument of Normals: flags}"""
    rng = np.random.default_rng(seed)
    return {"sharp_edges": rng.random(len(mesh[2])) < edges, "sharp_faces": rng.random(len(mesh[1])) < faces}


def normals_of(mesh, **sharp):
    points, offsets, corners, edges = arrays_of(mesh)
    return sinew.Normals(len(points), offsets, corners, edges, **sharp)


def test_its_domain_is_the_smallest_that_suffices():
    mesh = mesh_of(2)
    points = bent(mesh[0])
    flat = {"sharp_faces": np.ones(len(mesh[1]), bool)}
    for sharp, domain in (({}, "vertex"), (sharp_of(mesh), "corner"), (flat, "face")):
        normals = normals_of(mesh, **sharp)
        assert normals.domain == domain
        np.testing.assert_array_equal(normals.compute(points), normals.compute(points, domain))
    corners = normals_of(mesh).compute(points, "corner")
    np.testing.assert_array_equal(corners, normals_of(mesh).compute(points)[np.concatenate(mesh[1])])
    corners = normals_of(mesh, **flat).compute(points, "corner")
    sizes = [len(face) for face in mesh[1]]
    np.testing.assert_array_equal(corners, np.repeat(normals.compute(points), sizes, axis=0))


def test_degenerate_faces_have_defined_normals():
    points = np.float32([[3, 4, 0], [3, 4, 0], [3, 4, 0], [4, 4, 0], [5, 4, 0], [0, 0, 0]])
    # A point, a line, one corner, none, two; in the middle of the line the angle is pi.
    faces = [[0, 1, 2], [0, 3, 4], [1], [], [2, 3]]
    offsets = np.cumsum([0, *map(len, faces)])
    normals = sinew.Normals(6, offsets, np.concatenate(faces).astype(int))
    np.testing.assert_array_equal(normals.compute(points, "face"), np.tile([0, 0, 1], (5, 1)))
    np.testing.assert_array_equal(
        normals.compute(points)[[0, 3, 4, 5]], [[0, 0, 1], [0, 0, 1], [0, 0, 0], [0, 0, 0]]
    )
    back_to_back = sinew.Normals(3, [0, 3, 6], [0, 1, 2, 0, 2, 1])
    assert not back_to_back.compute([[0, 0, 0], [1, 0, 0], [0, 1, 0]]).any()


def test_edges_are_needed_only_for_sharp_meshes():
    mesh = mesh_of(2)
    points, offsets, corners, edges = arrays_of(mesh)
    normals = sinew.Normals(len(points), offsets, corners)
    np.testing.assert_array_equal(normals.compute(points), normals_of(mesh).compute(points))
    flat = np.arange(len(mesh[1])) == 4
    with pytest.raises(ValueError, match="edges: expected every edge of each face"):
        sinew.Normals(len(points), offsets, corners, sharp_faces=flat)
    assert sinew.Normals(len(points), offsets, corners, edges, sharp_faces=flat).domain == "corner"
