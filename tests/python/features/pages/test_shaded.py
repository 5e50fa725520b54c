# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects small pictures: they show the surface that is nearest, where it is, lit from the upper left."""

import numpy as np
from sinew_addon.features.measure.metrics import Shape
from sinew_addon.features.pages import shaded
from sinew_addon.features.pages.views import View
from sinew_addon.skinning.surface import Surface

FRONT = View(np.array([0.0, -1.0, 0.0]), np.zeros(3), 2.0, 2.0, 4.0)


def square(size, y, turned=False):
    """Points and triangles, facing the camera unless turned."""
    points = [(x * size, y, z * size) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    triangles = [(0, 1, 2), (0, 2, 3)]
    return points, [triangle[::-1] if turned else triangle for triangle in triangles]


def drawn(*parts):
    points, triangles = [], []
    for own, faces in parts:
        triangles += [tuple(corner + len(points) for corner in face) for face in faces]
        points += own
    surface = Surface(len(points), np.array(triangles, np.int32), np.empty((0, 2), np.int32))
    return shaded.draw(Shape(surface, np.array(points, float)), FRONT, 16)


def test_what_is_seen_is_where_it_is():
    picture = drawn(square(0.5, 0.0))
    covered = np.zeros((16, 16))
    covered[4:12, 4:12] = 1.0
    np.testing.assert_array_equal(picture[..., 3], covered)


def test_the_nearest_is_seen():
    small, large = square(0.25, -1.0, turned=True), square(1.0, 0.0)
    picture, other = drawn(small, large), drawn(large, small)
    np.testing.assert_array_equal(picture, other)
    # From inside it is reddish.
    assert picture[8, 8, 0] > 1.5 * picture[8, 8, 1]
    assert picture[1, 1, 0] < 1.2 * picture[1, 1, 1]


def test_light_comes_from_the_upper_left():
    # A cylinder along Z, whose left half faces left.
    angles = np.linspace(-np.pi / 2, np.pi / 2, 9)
    points = [(0.8 * np.sin(a), -0.8 * np.cos(a), z) for a in angles for z in (-1.0, 1.0)]
    faces = [f for k in range(8) for f in ((2 * k, 2 * k + 2, 2 * k + 3), (2 * k, 2 * k + 3, 2 * k + 1))]
    picture = drawn((points, faces))
    row = picture[8, :, 0]
    assert row[4] > row[8] > row[11] > 0.0


def test_nothing_in_the_picture_is_an_empty_one():
    points, triangles = square(0.5, 0.0)
    assert not drawn(([(x + 9, y, z) for x, y, z in points], triangles)).any()
