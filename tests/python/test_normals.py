# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sinew.Normals: compared with float64 numpy."""

import normals_reference as reference
import numpy as np
import pytest
import sinew
from test_delta_mush import arrays_of, bent, mesh_of

DOMAINS = ("vertex", "corner", "face")


def sharp_of(mesh, edges=0.2, faces=0.1, seed=3):
    """{argument of Normals: flags}"""
    rng = np.random.default_rng(seed)
    return {"sharp_edges": rng.random(len(mesh[2])) < edges, "sharp_faces": rng.random(len(mesh[1])) < faces}


def custom_of(mesh, seed=4):
    """int16 [corners, 2], some of them 0."""
    rng = np.random.default_rng(seed)
    numbers = rng.integers(-32768, 32768, (sum(map(len, mesh[1])), 2))
    return (numbers * (rng.random(numbers.shape) < 0.8)).astype(np.int16)


def normals_of(mesh, **sharp):
    points, offsets, corners, edges = arrays_of(mesh)
    return sinew.Normals(len(points), offsets, corners, edges, **sharp)


def expected_of(points, mesh, sharp, domain):
    faces, edges = mesh[1:]
    if domain == "face":
        return reference.face_normals(points, faces)
    if domain == "vertex":
        return reference.vertex_normals(points, faces)
    return reference.corner_normals(points, faces, edges, **sharp)


def with_large_faces(mesh):
    """Adds polygons of up to 70 corners."""
    points, faces, edges = mesh
    for count in (5, 7, 8, 9, 32, 33, 70):
        turn = 2 * np.pi * np.arange(count) / count
        ring = len(points) + np.arange(count)
        points = np.vstack([points, np.stack([np.cos(turn), np.sin(turn), 0.1 * np.cos(3 * turn)], axis=1)])
        faces = [*faces, ring.tolist()]
        edges = np.vstack([edges, np.stack([ring, np.roll(ring, -1)], axis=1)])
    return points.astype(np.float32), faces, np.sort(edges, axis=1).astype(np.int32)


@pytest.mark.parametrize("share", [(0.2, 0.1), (0.7, 0.0), (0.0, 0.4)])
@pytest.mark.parametrize("domain", DOMAINS)
def test_agrees_with_the_reference(domain, share):
    mesh = with_large_faces(mesh_of(1))
    sharp = sharp_of(mesh, *share)
    points = bent(mesh[0])
    normals = normals_of(mesh, **sharp)
    assert normals.domain == "corner"
    got = normals.compute(points, domain)
    assert got.dtype == np.float32
    assert len(got) == getattr(normals, f"{domain}_count")
    np.testing.assert_allclose(got, expected_of(points, mesh, sharp, domain), rtol=0, atol=1e-5)


@pytest.mark.parametrize("share", [(0.0, 0.0), (0.2, 0.1), (0.8, 0.0), (0.0, 1.0)])
@pytest.mark.parametrize("is_bent", [False, True])
def test_custom_normals_agree_with_the_reference(share, is_bent):
    mesh = mesh_of(1)
    sharp, custom = sharp_of(mesh, *share), custom_of(mesh)
    points = bent(mesh[0]) if is_bent else mesh[0]
    normals = normals_of(mesh, **sharp, custom_normals=custom)
    assert normals.domain == "corner"
    expected = reference.custom_normals(points, mesh[1], mesh[2], custom, **sharp)
    # For edges almost along the normal, the angle about it is less precise.
    np.testing.assert_allclose(normals.compute(points), expected, rtol=0, atol=5e-5)
    plain = normals_of(mesh, **sharp)
    for domain in ("vertex", "face"):
        np.testing.assert_array_equal(normals.compute(points, domain), plain.compute(points, domain))


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


def test_writes_in_place_and_on_any_number_of_threads():
    mesh = mesh_of(2, size=140)
    normals = normals_of(mesh, **sharp_of(mesh))
    points = bent(mesh[0])
    faces = len(mesh[1])
    assert repr(normals) == f"<sinew.Normals: {len(points)} vertices, {faces} faces, domain corner>"
    for domain in DOMAINS:
        expected = normals.compute(points, domain, threads=1)
        for threads in (None, 0, 2, np.int8(3), 10**30):
            np.testing.assert_array_equal(normals.compute(points, domain, threads=threads), expected)
        out = np.zeros_like(expected)
        assert normals.compute(points.astype(np.float64).tolist(), domain, out) is out
        np.testing.assert_array_equal(out, expected)
