# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the parts of a contact sheet are, in pixels from its left and top: in a picture, or over a view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

GAP = 6
# Pixels of a picture: the least in which figures are read, what is large enough to scroll rather than to
# shrink it, and the most.
LEAST, ENOUGH, MOST = 92, 140, 400
# Pixels of the least letters: of labels and of figures. Both grow with the pictures.
LABEL, FIGURE = 12, 11
# The height of a line, and the width of a figure, as parts of a letter's size; how many figures there are.
LINE, WIDE, FIGURES = 1.35, 8.0, 4


class Box(NamedTuple):
    left: float
    top: float
    width: float
    height: float

    def has(self, x: float, y: float) -> bool:
        return 0 <= x - self.left < self.width and 0 <= y - self.top < self.height


class Hit(NamedTuple):
    """column: None where it is the label of the row"""

    row: int
    column: int | None = None


@dataclass(frozen=True)
class Layout:
    """
    size   pixels of a picture, which is square
    scale  of the interface, for letters
    """

    rows: int
    columns: int
    size: int
    scale: float = 1.0

    @classmethod
    def fitting(cls, rows: int, columns: int, width: float, height: float, scale: float = 1.0) -> Self:
        """Returns one whose pictures are as large as the room allows. Where they would be small, only the
        width counts, and one scrolls."""
        sizes = range(round(LEAST * scale), round(MOST * scale))
        found = [cls(rows, columns, size, scale) for size in reversed(sizes)]
        wide = [each for each in found if each.width <= width] or found[-1:]
        whole = next((each for each in wide if each.height <= height), wide[-1])
        enough = next((each for each in wide if each.size <= ENOUGH * scale), wide[-1])
        return max(whole, enough, key=lambda each: each.size)

    def zoomed(self, factor: float) -> Self:
        size = min(max(self.size * factor, LEAST * self.scale), 2 * MOST * self.scale)
        return replace(self, size=round(size))

    @property
    def letters(self) -> int:
        """Pixels of those of labels."""
        return max(round(self.size / 17), round(LABEL * self.scale))

    @property
    def small_letters(self) -> int:
        """Pixels of those of poses and figures."""
        return max(round(self.size / 21), round(FIGURE * self.scale))

    @property
    def line(self) -> int:
        return round(LINE * self.letters)

    @property
    def small_line(self) -> int:
        return round(LINE * self.small_letters)

    @property
    def in_line(self) -> int:
        """How many figures are beside each other."""
        return 1 if self.size < 2 * WIDE * self.small_letters else 2

    @property
    def label_width(self) -> int:
        return max(round(0.75 * self.size), round(10 * self.letters))

    @property
    def head(self) -> int:
        """The height of what is above the rows."""
        return 2 * self.line + self.small_line + 3 * GAP

    @property
    def row_height(self) -> int:
        return self.size + FIGURES // self.in_line * self.small_line + 3 * GAP

    @property
    def width(self) -> int:
        return self.label_width + self.columns * (self.size + GAP) + GAP

    @property
    def height(self) -> int:
        return self.head + self.rows * self.row_height

    def title(self) -> Box:
        return Box(GAP, GAP, self.width - 2 * GAP, self.line)

    def joint(self, column: int) -> Box:
        """Of the joint's name, with its pose in the line below."""
        return Box(self._left(column), 2 * GAP + self.line, self.size, self.line + self.small_line)

    def label(self, row: int) -> Box:
        return Box(0, self._top(row), self.label_width, self.size)

    def picture(self, row: int, column: int) -> Box:
        return Box(self._left(column), self._top(row), self.size, self.size)

    def figure(self, row: int, column: int, number: int) -> Box:
        line, place = divmod(number, self.in_line)
        x = self._left(column) + place * self.size / self.in_line
        y = self._top(row) + self.size + GAP / 2 + line * self.small_line
        return Box(x, y, self.size / self.in_line, self.small_line)

    def hit(self, x: float, y: float) -> Hit | None:
        """What is at a place: a picture with its figures, or a row's label."""
        row = int((y - self.head) // self.row_height)
        if not 0 <= row < self.rows:
            return None
        if self.label(row).has(x, y):
            return Hit(row)
        cells = ((column, self.picture(row, column)) for column in range(self.columns))
        height = self.row_height - 2 * GAP
        return next((Hit(row, each) for each, box in cells if box._replace(height=height).has(x, y)), None)

    def _left(self, column: int) -> int:
        return self.label_width + column * (self.size + GAP)

    def _top(self, row: int) -> int:
        return self.head + row * self.row_height


@dataclass(frozen=True)
class Panned:
    """A layout that is seen through a room, whose upper part always has the heads of the columns.

    room       what of a region is free, from its left and its top
    left, top  where the sheet is in the room
    """

    layout: Layout
    room: Box
    left: float = 0.0
    top: float = 0.0

    def moved(self, right: float, down: float) -> Self:
        """The same, moved as far as there is something to see; in the middle where all is seen."""
        lefts, tops = self.room.width - self.layout.width, self.room.height - self.layout.height
        left = lefts / 2 if lefts > 0 else min(max(self.left + right, lefts), 0.0)
        return replace(self, left=left, top=min(max(self.top + down, min(tops, 0.0)), 0.0))

    def zoomed(self, factor: float, x: float, y: float) -> Self:
        """The same, larger by a factor; what is at a place of the region stays near it."""
        layout, x, y = self.layout.zoomed(factor), x - self.room.left, y - self.room.top
        wider, higher = layout.width / self.layout.width, layout.height / self.layout.height
        left, top = x - wider * (x - self.left), y - higher * (y - self.top)
        return replace(self, layout=layout, left=left, top=top).moved(0.0, 0.0)

    def hit(self, x: float, y: float) -> Hit | None:
        """What is at a place of the region, from its left and its top."""
        x, y = x - self.room.left, y - self.room.top
        return None if y < self.layout.head else self.layout.hit(x - self.left, y - self.top)


def wrapped(text: str, width: float, width_of: Callable[[str], float]) -> list[str]:
    """Returns the lines of a text, broken between words."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and width_of(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def figure_text(name: str, value: float, is_signed: bool) -> str:
    """name: of a figure, as it is read"""
    sign = "+" if is_signed else ""
    return f"{name} {100 * value:{sign}.0f} %"
