# SPDX-License-Identifier: GPL-3.0-or-later
"""A comparison sheet: pictures of several methods side by side in one image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import SinewError
from .output import write_whole

if TYPE_CHECKING:
    from PIL import ImageDraw

BACKGROUND = (38, 40, 44)
TEXT = (232, 232, 232)
FAINT = (160, 164, 170)
MARGIN = 16


def require_pillow() -> None:
    """Raises SinewError where Pillow is missing, as in Blender's own Python."""
    try:
        import PIL  # noqa: F401
    except ImportError:
        raise SinewError(
            "sheets need Pillow, which this Python does not have; "
            "install sinew-blender in a Python of its own and run `sinew compare` there"
        ) from None


@dataclass(frozen=True)
class Column:
    """One method's part of the sheet: its name, a line about it, and its pictures from top to bottom."""

    title: str
    note: str
    pictures: Sequence[Path]


def write_sheet(title: str, columns: Sequence[Column], row_titles: Sequence[str], path: Path) -> None:
    """Writes the pictures side by side, labelled, to one PNG.

    Requires Pillow. Raises SinewError where the file cannot be written.
    """
    from PIL import Image, ImageDraw, ImageFont

    large, small = ImageFont.load_default(size=24), ImageFont.load_default(size=17)
    pictures = [[Image.open(picture).convert("RGBA") for picture in column.pictures] for column in columns]
    cell = max(picture.width for column in pictures for picture in column)
    heights = [picture.height for picture in pictures[0]]
    head, label, row_label = 24 + 2 * MARGIN, 24 + 17 + 2 * MARGIN, 17 + MARGIN
    width = len(columns) * (cell + MARGIN) + MARGIN
    height = head + label + len(row_titles) * row_label + sum(heights) + MARGIN
    sheet = Image.new("RGB", (width, height), BACKGROUND)
    draw = ImageDraw.Draw(sheet)
    draw.text((MARGIN, MARGIN), _fitted(draw, title, large, width - 2 * MARGIN), font=large, fill=TEXT)
    for index, column in enumerate(columns):
        x = MARGIN + index * (cell + MARGIN)
        draw.text((x, head), _fitted(draw, column.title, large, cell), font=large, fill=TEXT)
        draw.text(
            (x, head + 24 + MARGIN // 2), _fitted(draw, column.note, small, cell), font=small, fill=FAINT
        )
        for row, picture in enumerate(pictures[index]):
            y = head + label + row * row_label + sum(heights[:row])
            draw.text((x, y), _fitted(draw, row_titles[row], small, cell), font=small, fill=FAINT)
            sheet.paste(picture, (x + (cell - picture.width) // 2, y + row_label - MARGIN // 2), picture)
    write_whole(path, lambda unfinished: sheet.save(unfinished, format="PNG"))


def _fitted(draw: ImageDraw.ImageDraw, text: str, font: Any, width: int) -> str:
    """`text`, cut with an ellipsis where it is wider than `width` pixels."""
    if draw.textlength(text, font=font) <= width:
        return text
    while text and draw.textlength(text + "…", font=font) > width:
        text = text[:-1]
    return text + "…"
