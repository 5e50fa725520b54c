# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a contact sheet over a 3D view; nothing of this is in the file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.presets import draw_texture_2d

from ...ui.sidebar import uncovered
from ...ui.translations import tr
from ..heat.heat_legend import draw_rectangle
from ..pages.sheet import BEST, CLOTH, FAINT, INK, PAPER, Sheet, colours
from ..pages.sheet_layout import GAP, LINE, Box, Hit, Panned, figure_text, wrapped

FONT = 0
# Room at the edges of the view, and for the hint at the bottom, in points.
MARGIN, HINT = 8, 32
CHIP, CHIP_TEXT = (0.05, 0.05, 0.05, 0.8), (1.0, 1.0, 1.0)
USED, HOVER = (0.16, 0.42, 0.75, 1.0), (0.98, 0.55, 0.10, 1.0)


@dataclass
class Shown:
    """A sheet in a region of a 3D view.

    region      its address: Blender makes others at will
    ticks       of the colours of a difference
    hint        a line at the bottom: what keys do
    used        the row that deforms the character now; -1 for none
    over        what is under the mouse
    is_looking  only the hint is shown, as the view shows what a cell did
    """

    sheet: Sheet
    place: Panned
    region: int
    ticks: tuple[str, str] = ("", "")
    hint: str = ""
    used: int = -1
    over: Hit | None = None
    is_looking: bool = False
    _textures: dict[tuple[int, int], gpu.types.GPUTexture] = field(default_factory=dict)

    def forget(self, row: int, column: int) -> None:
        """Has a cell's picture be made again."""
        self._textures.pop((row, column), None)

    def forget_all(self) -> None:
        self._textures.clear()

    def texture(self, row: int, column: int) -> gpu.types.GPUTexture:
        """Only while something is drawn."""
        if (row, column) not in self._textures:
            pixels = self.sheet.pixels(self.sheet.cells[row, column], self.sheet.scale)
            data = np.ascontiguousarray(pixels, np.float32)
            size = data.shape[1], data.shape[0]
            buffer = gpu.types.Buffer("FLOAT", data.size, data.ravel())
            self._textures[row, column] = gpu.types.GPUTexture(size, format="RGBA16F", data=buffer)
        return self._textures[row, column]


# That of the window; None where none is open.
shown: list[Shown] = []


def free_box(area: bpy.types.Area, region: bpy.types.Region) -> Box:
    """Returns where a sheet is seen in a view: not below sidebar, toolbar, headers or the hint. From the
    left and the top."""
    left, right = uncovered(area, region)
    top, bottom = 0.0, float(region.height)
    for other in area.regions:
        begin = other.y - region.y
        if other.type not in ("HEADER", "TOOL_HEADER", "ASSET_SHELF", "ASSET_SHELF_HEADER"):
            continue
        if other.height <= 1 or not -other.height < begin < region.height:
            continue
        if 2 * begin + other.height > region.height:
            top = max(top, region.height - begin)
        else:
            bottom = min(bottom, region.height - begin - other.height)
    scale = bpy.context.preferences.system.ui_scale
    margin, hint = MARGIN * scale, HINT * scale
    return Box(left + margin, top + margin, right - left - 2 * margin, bottom - top - 2 * margin - hint)


def draw() -> None:
    context = bpy.context
    if not shown or context.region.as_pointer() != shown[0].region:
        return
    own, height = shown[0], context.region.height
    if not own.is_looking:
        draw_rectangle(0, 0, context.region.width, height, (*PAPER, 1.0))
        _Drawing(own, own.place, height).draw_rows()
        _Drawing(own, replace(own.place, top=0.0), height).draw_head()
        below = height - own.place.room.top - own.place.room.height
        draw_rectangle(0, 0, context.region.width, below, (*PAPER, 1.0))
    _draw_hint(own.hint, own.place.room, height, context.preferences.system.ui_scale)


class _Drawing:
    """Draws by places of the layout, which count from the left and the top."""

    def __init__(self, own: Shown, place: Panned, height: int) -> None:
        self.own, self.sheet, self.layout, self.room = own, own.sheet, place.layout, place.room
        self.left, self.top = place.room.left + place.left, place.room.top + place.top
        self.height = height

    def draw_rows(self) -> None:
        for column in range(self.layout.columns):
            marks = self.sheet.best(column)
            for row in range(self.layout.rows):
                self._draw_cell(row, column, marks.get(row, set()))
        for row, text in enumerate(self.sheet.rows):
            self._draw_label(row, text)

    def draw_head(self) -> None:
        layout = self.layout
        above = Box(-self.left, -self.top, 1e5, self.top + layout.head - GAP / 2)
        self._fill(above, (*PAPER, 1.0))
        title = layout.title()
        self._write(self.sheet.title, title.left, title.top, layout.letters, INK)
        if self.sheet.is_difference:
            self._draw_legend(self.own.ticks)
        for column, (joint, pose) in enumerate(self.sheet.columns):
            box = layout.joint(column)
            self._write(tr(joint), box.left, box.top, layout.letters, INK)
            self._write(tr(pose), box.left, box.top + layout.line, layout.small_letters, FAINT)

    def _draw_label(self, row: int, text: str) -> None:
        layout, box = self.layout, self.layout.label(row)
        if row == self.own.used:
            self._fill(box._replace(width=4), USED)
        if self.own.over == Hit(row):
            self._fill(Box(box.left, box.top + box.height - 2, box.width - GAP, 2), HOVER)
        number = f"{row + 1}  " if row < 9 else ""
        blf.size(FONT, layout.letters)
        lines = wrapped(number + text, box.width - 3 * GAP, lambda line: blf.dimensions(FONT, line)[0])
        for place, line in enumerate(lines):
            top = box.top + GAP + place * layout.line
            self._write(line, box.left + 2 * GAP, top, layout.letters, INK)

    def _draw_cell(self, row: int, column: int, marks: set[str]) -> None:
        layout, box = self.layout, self.layout.picture(row, column)
        x, y = self._place(box.left, box.top + box.height)
        if y > self.height or y + layout.row_height < 0:
            return
        if self.own.over == Hit(row, column):
            edge = 2
            around = Box(box.left - edge, box.top - edge, box.width + 2 * edge, box.height + 2 * edge)
            self._fill(around, HOVER)
        cell = self.sheet.cells.get((row, column))
        if cell is None:
            self._fill(box, (*CLOTH, 1.0))
            return
        draw_texture_2d(self.own.texture(row, column), (x, y), box.width, box.height)
        for number, (name, value) in enumerate(cell.figures._asdict().items()):
            place, is_best = layout.figure(row, column, number), name in marks
            if is_best:
                dot = 0.4 * layout.small_letters
                middle = place.top + (place.height - dot) / 2
                self._fill(Box(place.left, middle, dot, dot), (*BEST, 1.0))
            text = figure_text(tr(name), value, name == "volume")
            left = place.left + 0.7 * layout.small_letters
            self._write(text, left, place.top, layout.small_letters, BEST if is_best else FAINT)

    def _draw_legend(self, ticks: tuple[str, str]) -> None:
        """At the right end of the title's line."""
        layout, title = self.layout, self.layout.title()
        size, width = layout.small_letters, 120.0 * layout.scale
        text = tr("Difference to {first}", first=self.sheet.rows[0])
        blf.size(FONT, size)
        wide = [blf.dimensions(FONT, each)[0] for each in (text, *ticks)]
        left = min(title.left + title.width, self.room.width - self.left) - sum(wide) - width - 5 * GAP
        self._write(text, left, title.top, size, FAINT)
        self._write(ticks[0], left + wide[0] + 2 * GAP, title.top, size, FAINT)
        left += wide[0] + wide[1] + 3 * GAP
        stops = colours(np.linspace(0.0, 1.0, 48))
        for number, colour in enumerate(stops):
            part = width / len(stops)
            self._fill(Box(left + number * part, title.top + 2, part + 1, title.height - 4), (*colour, 1.0))
        self._write(ticks[1], left + width + GAP, title.top, size, FAINT)

    def _place(self, x: float, y: float) -> tuple[float, float]:
        """From the left and the bottom of the region."""
        return round(self.left + x), round(self.height - self.top - y)

    def _fill(self, box: Box, colour: tuple[float, ...]) -> None:
        x, y = self._place(box.left, box.top + box.height)
        draw_rectangle(x, y, round(box.width), round(box.height), colour)

    def _write(self, text: str, left: float, top: float, size: int, colour: tuple[float, ...]) -> None:
        """top: of the line"""
        x, y = self._place(left, top + size)
        blf.size(FONT, size)
        blf.color(FONT, *colour, 1.0)
        blf.position(FONT, x, y, 0.0)
        blf.draw(FONT, text)


def _draw_hint(text: str, box: Box, height: int, scale: float) -> None:
    size, pad = round(12 * scale), round(7 * scale)
    blf.size(FONT, size)
    lines = wrapped(text, box.width - 4 * pad, lambda line: blf.dimensions(FONT, line)[0])
    wide = max((blf.dimensions(FONT, line)[0] for line in lines), default=0.0)
    tall = round(LINE * size)
    x, y = box.left + (box.width - wide) / 2, height - box.top - box.height - HINT * scale + pad
    draw_rectangle(x - 2 * pad, y - pad, wide + 4 * pad, tall * len(lines) + 1.5 * pad, CHIP)
    blf.color(FONT, *CHIP_TEXT, 1.0)
    for number, line in enumerate(reversed(lines)):
        blf.position(FONT, round(x), round(y + number * tall + 0.3 * size), 0.0)
        blf.draw(FONT, line)
