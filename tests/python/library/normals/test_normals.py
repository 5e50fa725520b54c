# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects domains of sinew.Normals, degenerate faces and missing edges. The oracle is Blender, in
tests/blender/skinning/test_normals.py."""

import numpy as np
import pytest
import sinew

# A bent sheet: a quad and two triangles.
POINTS = np.float32([[0, 0, 0], [1, 0, 0.5], [2, 0, 0], [0, 1, 0], [1, 1, 0.7], [2, 1, -0.2]])
SIZES, CORNERS = [4, 3, 3], [0, 1, 4, 3, 1, 2, 4, 2, 5, 4]
FACES = 6, np.cumsum([0, *SIZES]), CORNERS
EDGES = [[0, 1], [1, 4], [3, 4], [0, 3], [1, 2], [2, 4], [2, 5], [4, 5]]


def test_its_domain_is_the_smallest_that_suffices():
    flat, sharp = {"sharp_faces": [True] * 3}, {"sharp_edges": [True] + [False] * 7}
    for flags, domain in (({}, "vertex"), (sharp, "corner"), (flat, "face")):
        normals = sinew.Normals(*FACES, EDGES, **flags)
        assert normals.domain == domain
        np.testing.assert_array_equal(normals.compute(POINTS), normals.compute(POINTS, domain))
    corners = sinew.Normals(*FACES, EDGES).compute(POINTS, "corner")
    np.testing.assert_array_equal(corners, sinew.Normals(*FACES, EDGES).compute(POINTS)[CORNERS])
    corners = sinew.Normals(*FACES, EDGES, **flat).compute(POINTS, "corner")
    np.testing.assert_array_equal(corners, np.repeat(normals.compute(POINTS), SIZES, axis=0))


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
    smooth = sinew.Normals(*FACES)
    np.testing.assert_array_equal(smooth.compute(POINTS), sinew.Normals(*FACES, EDGES).compute(POINTS))
    one = {"sharp_faces": [False, True, False]}
    with pytest.raises(ValueError, match="edges: expected every edge of each face"):
        sinew.Normals(*FACES, **one)
    assert sinew.Normals(*FACES, EDGES, **one).domain == "corner"
