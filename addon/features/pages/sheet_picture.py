# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet as one picture: cells in a grid with labels, without a graphics card."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...ui.translations import tr
from .lettering import Letters, letters
from .sheet import BEST, CLOTH, FAINT, INK, PAPER, Sheet, colours
from .sheet_layout import GAP, Box, Layout, figure_text, wrapped

Canvas = np.ndarray
"""float32 [height, width, 3], sRGB in 0..1, from the top"""


def compose(sheet: Sheet, size: int, ticks: Sequence[str]) -> np.ndarray:
    """Returns float32 [height, width, 4], RGBA in 0..1, from the bottom row up.

    size   pixels of each cell's picture, of which cells may have a whole multiple
    ticks  the least and the most of the colours of a difference, with units
    """
    layout = Layout(len(sheet.rows), len(sheet.columns), size)
    canvas = np.empty((layout.height, layout.width, 3), np.float32)
    canvas[:] = PAPER
    with letters(layout.letters, layout.small_letters) as (large, small):
        title = layout.title()
        large.draw(canvas, title.left, title.top, sheet.title, INK)
        if sheet.is_difference:
            _draw_legend(canvas, title, sheet, ticks, small)
        for column, (joint, pose) in enumerate(sheet.columns):
            box = layout.joint(column)
            large.draw(canvas, box.left, box.top, tr(joint), INK)
            small.draw(canvas, box.left, box.top + layout.line, tr(pose), FAINT)
        for row, text in enumerate(sheet.rows):
            box = layout.label(row)
            for number, line in enumerate(wrapped(text, box.width - 2 * GAP, large.width)):
                large.draw(canvas, box.left + GAP, box.top + GAP + number * layout.line, line, INK)
        for row in range(layout.rows):
            for column in range(layout.columns):
                _part(canvas, layout.picture(row, column))[:] = CLOTH
        _draw_cells(canvas, sheet, layout, small)
    whole = np.ones((*canvas.shape[:2], 4), np.float32)
    whole[..., :3] = canvas[::-1]
    return whole


def _draw_cells(canvas: Canvas, sheet: Sheet, layout: Layout, small: Letters) -> None:
    scale, marks = sheet.scale, [sheet.best(column) for column in range(layout.columns)]
    for (row, column), cell in sheet.cells.items():
        pixels = _reduced(sheet.pixels(cell, scale), layout.size)
        _part(canvas, layout.picture(row, column))[:] = pixels[::-1, :, :3]
        for number, (name, value) in enumerate(cell.figures._asdict().items()):
            box, is_best = layout.figure(row, column, number), name in marks[column][row]
            colour = BEST if is_best else FAINT
            if is_best:
                _draw_dot(canvas, box, layout.small_letters)
            text = figure_text(tr(name), value, name == "volume")
            small.draw(canvas, box.left + 0.7 * layout.small_letters, box.top, text, colour)


def _reduced(pixels: np.ndarray, size: int) -> np.ndarray:
    """Returns float32 [size, size, 4]: means of squares."""
    each = len(pixels) // size
    return pixels.reshape(size, each, size, each, -1).mean(axis=(1, 3))


def _draw_dot(canvas: Canvas, line: Box, size: int) -> None:
    """Before a figure."""
    radius = 0.22 * size
    part = _part(canvas, line._replace(width=np.ceil(2 * radius) + 1))
    y, x = np.mgrid[: part.shape[0], : part.shape[1]] + 0.5
    cover = np.clip(radius + 0.5 - np.hypot(x - radius, y - line.height / 2), 0.0, 1.0)[..., None]
    part += (cover * (np.array(BEST) - part)).astype(np.float32)


def _draw_legend(canvas: Canvas, title: Box, sheet: Sheet, ticks: Sequence[str], small: Letters) -> None:
    """At the right end of the title's line."""
    text = tr("Difference to {first}", first=sheet.rows[0])
    least, most = ticks
    width = max(round(0.12 * title.width), 40)
    right = title.left + title.width - small.width(most)
    bar = Box(right - GAP - width, title.top + 2, width, title.height - 4)
    _part(canvas, bar)[:] = colours(np.linspace(0.0, 1.0, width))
    small.draw(canvas, right, title.top, most, FAINT)
    left = bar.left - GAP - small.width(least)
    small.draw(canvas, left, title.top, least, FAINT)
    small.draw(canvas, left - 2 * GAP - small.width(text), title.top, text, FAINT)


def _part(canvas: Canvas, box: Box) -> Canvas:
    left, top = round(box.left), round(box.top)
    return canvas[top : top + round(box.height), left : left + round(box.width)]
