# SPDX-License-Identifier: GPL-3.0-or-later
"""A comparison sheet: where methods differ most, how the cameras stand, and the picture put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import SinewError

BACKGROUND = (38, 40, 44)
TEXT = (232, 232, 232)
FAINT = (160, 164, 170)
MARGIN = 16
# A little to the character's left and above, from Blender's front (-Y).
VIEW_DIRECTION = np.array([0.45, -1.0, 0.22])
# Close-ups show this part of the mesh's diagonal.
CLOSE_UP = 0.22


@dataclass(frozen=True)
class View:
    """An orthographic camera.

    direction  unit, from the target towards the camera
    target     what the camera looks at
    size       height and width seen
    depth      how far before and behind the target is seen
    """

    direction: np.ndarray
    target: np.ndarray
    size: float
    depth: float


def whole_view(points: np.ndarray) -> View:
    """Frames `points` [n, 3] from the front, all of them inside."""
    direction = VIEW_DIRECTION / np.linalg.norm(VIEW_DIRECTION)
    right, up = camera_axes(direction)
    seen = np.stack([points @ right, points @ up, points @ direction], axis=1)
    low, high = seen.min(axis=0), seen.max(axis=0)
    centre = (low + high) / 2
    target = centre[0] * right + centre[1] * up + centre[2] * direction
    extent = float(max(high[0] - low[0], high[1] - low[1], 1e-6))
    return View(direction, target, 1.06 * extent, float(high[2] - low[2]) + extent)


def close_view(meshes: Sequence[np.ndarray]) -> View | None:
    """Where the methods differ most, seen from where least stands in front.

    meshes  one [vertices, 3] for each method, of one topology

    None where they do not differ.
    """
    # Placed by the first method: a mean would be dragged along by one that tears the mesh apart.
    first = meshes[0]
    difference = np.max([np.linalg.norm(points - first, axis=1) for points in meshes], axis=0)
    diagonal = float(np.linalg.norm(np.ptp(first, axis=0)))
    if difference.max(initial=0.0) <= 1e-4 * diagonal:
        return None
    target = first[int(difference.argmax())]
    radius = 0.5 * CLOSE_UP * diagonal
    return View(_clearest_direction(first - target, radius), target, 2 * radius, diagonal)


def _clearest_direction(points: np.ndarray, radius: float) -> np.ndarray:
    """Unit: from where the origin is least hidden by `points`; of equals, nearest to the whole view's.

    Hidden means behind points that stand in front of the sphere of `radius` around the origin.
    """
    front = VIEW_DIRECTION / np.linalg.norm(VIEW_DIRECTION)
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, 16, endpoint=False), np.radians([10, 35, -15]))
    directions = np.stack([np.sin(turn) * np.cos(rise), -np.cos(turn) * np.cos(rise), np.sin(rise)], axis=-1)
    candidates = [front, *directions.reshape(-1, 3)]

    def hidden(direction: np.ndarray) -> float:
        along = points @ direction
        across = np.linalg.norm(points - np.outer(along, direction), axis=1)
        return float(np.count_nonzero((along > 0.6 * radius) & (across < 0.6 * radius)))

    return min(candidates, key=lambda direction: (hidden(direction), -float(direction @ front)))


def camera_axes(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right and up of a camera that stands in `direction` from its target, up as near to +Z as can be."""
    world_up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(world_up, direction)
    right /= np.linalg.norm(right)
    return right, np.cross(direction, right)


def require_pillow() -> None:
    """Raises SinewError where Pillow is missing, as in Blender's own Python."""
    try:
        import PIL  # noqa: F401
    except ImportError:
        raise SinewError(
            "comparison sheets need Pillow, which this Python does not have; "
            "install sinew-blender in a Python of its own and run `sinew compare` there"
        ) from None


@dataclass(frozen=True)
class Column:
    """One method's part of the sheet: its name, a line about it, and its pictures from top to bottom."""

    title: str
    note: str
    pictures: Sequence[Path]


def write_sheet(title: str, columns: Sequence[Column], row_titles: Sequence[str], path: Path) -> None:
    """Puts the pictures side by side, labelled, into one PNG; beside `path` first, then renamed.

    Requires Pillow. Raises SinewError where the file can not be written.
    """
    from PIL import Image, ImageDraw, ImageFont

    large, small = ImageFont.load_default(size=24), ImageFont.load_default(size=17)
    pictures = [[Image.open(picture).convert("RGBA") for picture in column.pictures] for column in columns]
    cell = pictures[0][0].width
    head, label, row_label = 24 + 2 * MARGIN, 24 + 17 + 2 * MARGIN, 17 + MARGIN
    width = len(columns) * (cell + MARGIN) + MARGIN
    height = head + label + len(row_titles) * (row_label + cell) + MARGIN
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
            y = head + label + row * (row_label + cell)
            draw.text((x, y), row_titles[row], font=small, fill=FAINT)
            sheet.paste(picture, (x, y + row_label - MARGIN // 2), picture)
    unfinished = path.with_name(f".{path.name}.unfinished")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        sheet.save(unfinished, format="PNG")
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise SinewError(f"{path}: can not be written: {error.strerror or error}") from None


def _fitted(draw, text: str, font, width: int) -> str:
    """`text`, cut with an ellipsis where it is wider than `width` pixels."""
    if draw.textlength(text, font=font) <= width:
        return text
    while text and draw.textlength(text + "…", font=font) > width:
        text = text[:-1]
    return text + "…"
