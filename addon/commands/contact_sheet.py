# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet of `sinew compare` as one picture: cells in a grid with labels, by Pillow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import SinewError
from ..base.output import write_whole
from ..features.measure.joint_figures import Figures, best

if TYPE_CHECKING:
    from PIL import ImageDraw, ImageFont

    from ..features.pages.contact_sheet import Cell

PAPER, INK, FAINT, BEST = (246, 246, 244), (28, 28, 30), (120, 120, 122), (0, 110, 80)
CELL = (228, 229, 231)
GAP = 6


def require_pillow() -> None:
    """Raises SinewError where Pillow is missing, as in Blender's own Python."""
    try:
        import PIL  # noqa: F401
    except ImportError:
        raise SinewError(
            "a contact sheet needs Pillow, which this Python does not have; install sinew-blender in a "
            "Python of its own and run `sinew` there"
        ) from None


def write(
    path: Path, title: str, rows: Sequence[str], columns: Sequence[tuple[str, str]], cells: Sequence[Cell]
) -> None:
    """Writes a PNG.

    title    one line on top
    rows     labels of variants
    columns  of each the joint and what it does
    cells    of any rows and columns; others stay empty
    """
    from PIL import Image, ImageDraw, ImageFont

    size = cells[0].pixels.shape[0]
    fonts = ImageFont.load_default(max(size // 17, 10)), ImageFont.load_default(max(size // 21, 9))
    line, small = (_height(font) for font in fonts)
    label, head, foot = round(0.75 * size), 2 * line + 3 * GAP + small, 2 * small + 2 * GAP
    width = label + len(columns) * (size + GAP) + GAP
    sheet = Image.new("RGB", (width, head + len(rows) * (size + foot + GAP) + GAP), PAPER)
    draw = ImageDraw.Draw(sheet)
    draw.text((GAP, GAP), title, INK, fonts[0])
    for column, (joint, pose) in enumerate(columns):
        x = label + column * (size + GAP)
        draw.text((x, 2 * GAP + line), joint, INK, fonts[0])
        draw.text((x, 2 * GAP + 2 * line), pose, FAINT, fonts[1])
    marks = _marks(cells)
    for row, text in enumerate(rows):
        y = head + row * (size + foot + GAP)
        _write_lines(draw, (GAP, y + GAP), text, label - 2 * GAP, fonts[0], line)
        draw.rectangle((label, y, width - GAP, y + size), CELL)
    for cell in cells:
        x, y = label + cell.column * (size + GAP), head + cell.row * (size + foot + GAP)
        pixels = np.round(255 * cell.pixels[::-1]).clip(0, 255).astype(np.uint8)
        picture = Image.fromarray(pixels)
        sheet.paste(picture, (x, y), picture)
        _write_figures(
            draw, (x, y + size + GAP // 2), cell.figures, marks[cell.row, cell.column], fonts[1], small
        )
    write_whole(path, lambda unfinished: sheet.save(unfinished, format="PNG", compress_level=3))


def _marks(cells: Sequence[Cell]) -> Mapping[tuple[int, int], set[str]]:
    """Where each is best in its column."""
    found: dict[tuple[int, int], set[str]] = {}
    for column in {cell.column for cell in cells}:
        own = [cell for cell in cells if cell.column == column]
        for cell, names in zip(own, best([cell.figures for cell in own]), strict=True):
            found[cell.row, cell.column] = names
    return found


def _write_figures(
    draw: ImageDraw.ImageDraw,
    place: tuple[int, int],
    figures: Figures,
    marked: set[str],
    font: ImageFont.FreeTypeFont,
    line: int,
) -> None:
    """Two in a line; the best of a column in green, with a dot before them."""
    size = 9.5 * font.size
    for number, (name, value) in enumerate(figures._asdict().items()):
        x, y = place[0] + (number % 2) * size, place[1] + (number // 2) * line
        text = f"{name} {100 * value:+.0f} %" if name == "volume" else f"{name} {100 * value:.0f} %"
        is_best = name in marked
        if is_best:
            radius, middle = font.size * 0.22, y + line / 2
            draw.ellipse((x, middle - radius, x + 2 * radius, middle + radius), BEST)
        draw.text((x + 0.7 * font.size, y), text, BEST if is_best else FAINT, font)


def _write_lines(
    draw: ImageDraw.ImageDraw,
    place: tuple[int, int],
    text: str,
    width: int,
    font: ImageFont.FreeTypeFont,
    line: int,
) -> None:
    """Breaks text between words."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and draw.textlength(longer, font) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    for number, each in enumerate(lines):
        draw.text((place[0], place[1] + number * line), each, INK, font)


def _height(font: ImageFont.FreeTypeFont) -> int:
    return round(1.35 * font.size)
