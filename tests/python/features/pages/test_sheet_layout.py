# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects where the parts of a contact sheet are, and what a click on it hits."""

import pytest
from sinew_addon.features.pages.sheet_layout import FIGURES, Box, Hit, Layout, Panned, figure_text, wrapped

ROOM = Box(50.0, 30.0, 900.0, 700.0)


@pytest.mark.parametrize("size", [92, 140, 240])
def test_parts_do_not_cover_each_other(size):
    layout = Layout(3, 4, size)
    cells = [(row, column) for row in range(3) for column in range(4)]
    boxes = [layout.picture(*cell) for cell in cells] + [layout.label(row) for row in range(3)]
    boxes += [layout.figure(*cell, number) for cell in cells for number in range(FIGURES)]
    boxes += [layout.joint(column) for column in range(4)] + [layout.title()]
    for number, one in enumerate(boxes):
        assert one.left >= 0
        assert one.top >= 0
        assert one.left + one.width <= layout.width
        assert one.top + one.height <= layout.height
        for other in boxes[:number]:
            beside = one.left >= other.left + other.width or other.left >= one.left + one.width
            above = one.top >= other.top + other.height or other.top >= one.top + one.height
            assert beside or above, (one, other)


def test_what_is_hit():
    layout = Layout(3, 4, 100)
    for row in range(3):
        assert layout.hit(*middle(layout.label(row))) == Hit(row)
        for column in range(4):
            assert layout.hit(*middle(layout.picture(row, column))) == Hit(row, column)
            assert layout.hit(*middle(layout.figure(row, column, FIGURES - 1))) == Hit(row, column)
    between = layout.picture(1, 1).left - 1, middle(layout.picture(1, 1))[1]
    for place in (
        between,
        (0, 0),
        middle(layout.joint(1)),
        (layout.width + 5, 300),
        (300, layout.height + 5),
    ):
        assert layout.hit(*place) is None


def middle(box):
    return box.left + box.width / 2, box.top + box.height / 2


def test_pictures_are_as_large_as_the_room_allows():
    layout = Layout.fitting(2, 4, ROOM.width, ROOM.height)
    larger = layout.zoomed((layout.size + 1) / layout.size)
    assert layout.width <= ROOM.width
    assert layout.height <= ROOM.height
    assert larger.width > ROOM.width or larger.height > ROOM.height
    # Of many rows only the width counts, and of many columns they stay legible.
    many = Layout.fitting(30, 4, ROOM.width, ROOM.height)
    assert many.width <= ROOM.width
    assert many.size > 100
    assert Layout.fitting(2, 40, ROOM.width, ROOM.height).size > 80


def test_what_is_scrolled_is_hit_where_it_is_seen():
    layout = Layout(9, 3, 150)
    place = Panned(layout, ROOM).moved(0.0, 0.0)
    assert place.left == (ROOM.width - layout.width) / 2
    assert place.top == 0.0
    scrolled = place.moved(0.0, -300.0)
    x, y = middle(layout.picture(4, 1))
    x, y = x + ROOM.left + scrolled.left, y + ROOM.top - 300.0
    assert scrolled.hit(x, y) == Hit(4, 1)
    assert place.hit(x, y) != Hit(4, 1)
    # The heads of the columns are above what is scrolled.
    assert scrolled.hit(x, ROOM.top + layout.head - 1) is None
    assert place.moved(0.0, 500.0) == place
    end = place.moved(0.0, -1e5)
    assert end.top + layout.height == ROOM.height


def test_what_is_zoomed_stays_under_the_mouse():
    place = Panned(Layout(9, 6, 150), ROOM).moved(-100.0, -400.0)
    x, y = middle(place.layout.picture(5, 3))
    x, y = x + ROOM.left + place.left, y + ROOM.top + place.top
    assert place.zoomed(1.2, x, y).hit(x, y) == Hit(5, 3)
    assert place.zoomed(1e9, x, y).layout == place.zoomed(2e9, x, y).layout


def test_texts():
    assert wrapped("Dual Quaternion with Mush", 12, len) == ["Dual", "Quaternion", "with Mush"]
    assert wrapped("", 12, len) == []
    assert figure_text("volume", 0.034, True) == "volume +3 %"
    assert figure_text("bulge", 0.034, False) == "bulge 3 %"
