# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what a contact sheet marks as best, and the colours of a difference to its first row."""

import numpy as np
from sinew_addon.features.measure.heat_scale import viridis
from sinew_addon.features.measure.joint_figures import Figures
from sinew_addon.features.pages.shaded import FRONT, Picture
from sinew_addon.features.pages.sheet import CLOTH, FADES, Cell, Sheet, colours


def cell(row, distance, stretch=0.1, column=0):
    """A picture whose left half shows something."""
    pixels, values = np.zeros((8, 8, 4), np.float32), np.zeros((8, 8), np.float32)
    pixels[:, :4] = (0.5, 0.5, 0.5, 1.0)
    values[:, :4] = distance
    light = np.where(pixels[..., 3] > 0, np.float32(1.0), np.float32(0.0))
    return Cell(row, column, Picture(pixels, light, values), Figures(stretch, 0.0, 0.0, 0.0), 1.0)


def sheet(*cells, is_difference=True):
    made = Sheet("Title", ["A", "B", "C"], [("Elbow", "bent")] * 2, is_difference=is_difference)
    for each in cells:
        made.add(each)
    return made


def test_the_range_is_a_round_number_beyond_what_is_seen():
    for distance, end in ((0.013, 0.02), (0.02, 0.02), (0.3, 0.5), (0.6, 1.0), (0.0, 1e-3)):
        scale = sheet(cell(0, 0.0), cell(1, distance)).scale
        assert np.isclose(scale.high, end), distance
        assert not scale.clipped
    # A few pixels do not make the range.
    outlier = cell(1, 0.013)
    outlier.picture.values[0, 0] = 3.0
    scale = sheet(cell(0, 0.0), outlier, *(cell(2, 0.013, column=k) for k in range(2))).scale
    assert np.isclose(scale.high, 0.02)
    assert scale.clipped


def test_rows_after_the_first_are_coloured():
    made = sheet(cell(0, 0.0), cell(1, 0.02), cell(2, np.nan))
    first, second, broken = (made.pixels(made.cells[row, 0], made.scale) for row in range(3))
    np.testing.assert_allclose(first[:, :4, :3], 0.5)
    np.testing.assert_allclose(second[:, :4, :3], np.tile(viridis(np.ones(1)), (8, 4, 1)), atol=1e-6)
    np.testing.assert_allclose(broken, second)
    for each in (first, second):
        np.testing.assert_allclose(each[:, 4:], np.tile((*CLOTH, 1.0), (8, 4, 1)), atol=1e-6)
    made.is_difference = False
    np.testing.assert_allclose(made.pixels(made.cells[1, 0], made.scale)[:, :4, :3], 0.5)


def test_clay_shines_through_where_shapes_are_alike():
    np.testing.assert_allclose(colours(np.zeros(1))[0], FRONT)
    shares = np.linspace(FADES, 1.0, 5)
    np.testing.assert_allclose(colours(shares), viridis(shares), atol=1e-12)


def test_the_best_of_what_is_drawn():
    made = sheet(cell(0, 0.0, 0.3), cell(1, 0.0, 0.1))
    assert made.best(0) == {0: set(), 1: {"stretch"}}
    assert made.best(1) == {}
    made.add(cell(2, 0.0, 0.01))
    assert made.best(0) == {0: set(), 1: set(), 2: {"stretch"}}
