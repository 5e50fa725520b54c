# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects which triangles of a surface cross each other: against the definition in float64."""

import itertools

import numpy as np
import pytest
import sinew


def an_edge_meets(first, second):
    """Whether an edge of the first [3, 3] has a point in the second [3, 3]."""
    origin, u, v = second[0], second[1] - second[0], second[2] - second[0]
    for k in range(3):
        along = first[(k + 1) % 3] - first[k]
        system = np.column_stack([-along, u, v])
        if abs(np.linalg.det(system)) < 1e-12:
            continue
        t, a, b = np.linalg.solve(system, first[k] - origin)
        if 0 <= t <= 1 and a >= 0 and b >= 0 and a + b <= 1:
            return True
    return False


def by_definition(points, triangles):
    return [
        [i, j]
        for i, j in itertools.combinations(range(len(triangles)), 2)
        if not set(triangles[i]) & set(triangles[j])
        if an_edge_meets(points[triangles[i]], points[triangles[j]])
        or an_edge_meets(points[triangles[j]], points[triangles[i]])
    ]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("threads", [1, 2])
def test_crossings_of_random_triangles(seed, threads):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(90, 3)) * rng.choice([0.2, 1.0, 5.0], size=(90, 1))
    triangles = np.array([rng.choice(90, 3, replace=False) for _ in range(120)], np.int32)
    found = sinew.crossing_triangles(points, triangles, threads=threads)
    assert found.tolist() == by_definition(points, triangles)
    assert len(found) > 100
    groups = rng.integers(-1, 3, len(triangles), np.int32)
    first, second = groups[found].T
    apart = sinew.crossing_triangles(points, triangles, groups, threads)
    np.testing.assert_array_equal(apart, found[(first != second) | (first < 0)])
    assert 0 < len(apart) < len(found)


def test_a_surface_that_is_far_from_the_origin():
    """Two sheets of many triangles, one through the other."""
    side = 40
    u, v = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    sheet = np.stack([u.ravel(), v.ravel(), 0 * u.ravel()], 1) / side
    corner = (u[:-1, :-1] * side + v[:-1, :-1]).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + side, corner + 1], 1),
            np.stack([corner + side, corner + side + 1, corner + 1], 1),
        ]
    )
    upright = sheet[:, [0, 2, 1]] + (0.0, 0.512, -0.487)
    points = np.concatenate([sheet, upright]) + 1e6
    triangles = np.concatenate([faces, faces + len(sheet)]).astype(np.int32)
    found = sinew.crossing_triangles(points, triangles)
    # Along the line where they meet, each triangle crosses some of the other sheet.
    assert len(found) >= 2 * (side - 1)
    assert (found[:, 0] < len(faces)).all()
    assert (found[:, 1] >= len(faces)).all()
    assert (abs(points[triangles[found[:, 0]]].mean(axis=1)[:, 1] - 1e6 - 0.512) < 2 / side).all()
    np.testing.assert_array_equal(found, np.unique(found, axis=0))


def test_what_does_not_cross():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.2, 0.2, -1), (0.3, 0.2, 1), (0.2, 0.3, 1)], float)
    across = np.int32([[0, 1, 2], [3, 4, 5]])
    assert sinew.crossing_triangles(points, across).tolist() == [[0, 1]]
    assert not len(sinew.crossing_triangles(points, [[0, 1, 2], [0, 4, 5]]))
    in_plane = points * (1, 1, 0)
    assert not len(sinew.crossing_triangles(in_plane, across))
    points[4] = np.nan
    assert not len(sinew.crossing_triangles(points, across))
    assert sinew.crossing_triangles(np.empty((0, 3)), np.empty((0, 3), np.int32)).shape == (0, 2)
    with pytest.raises(ValueError, match="triangles: expected vertices from 0 to 5, got 6"):
        sinew.crossing_triangles(points, [[0, 1, 6]])
    with pytest.raises(ValueError, match=r"groups: expected None or int32 \[2\], got"):
        sinew.crossing_triangles(points, across, [0])
