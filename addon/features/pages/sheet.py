# SPDX-License-Identifier: GPL-3.0-or-later
"""What a contact sheet shows: labels, and the cells that are drawn so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..measure.heat_scale import HeatScale, viridis
from ..measure.joint_figures import Figures, best
from ..measure.metrics import METRICS
from .shaded import FRONT, Picture

# sRGB
PAPER, CLOTH = (0.965, 0.965, 0.957), (0.894, 0.898, 0.906)
INK, FAINT, BEST = (0.11, 0.11, 0.118), (0.40, 0.40, 0.41), (0.0, 0.43, 0.314)
# The least range of colours, as a share of a picture's width.
LEAST_RANGE = 1e-3
# The share of all that is seen that the range has.
NEARLY_ALL = 0.98
# Up to this share of the range, clay shines through.
FADES = 0.15


@dataclass(frozen=True)
class Cell:
    """
    picture  its values are distances to the shape of the first row
    width    of what it shows
    """

    row: int
    column: int
    picture: Picture
    figures: Figures
    width: float


@dataclass
class Sheet:
    """
    title          one line
    rows           labels of variants
    columns        of each the joint and what it does
    cells          by row and column; others stay empty
    is_difference  rows after the first are in the colours of their distance to the first
    """

    title: str
    rows: Sequence[str]
    columns: Sequence[tuple[str, str]]
    cells: dict[tuple[int, int], Cell] = field(default_factory=dict)
    is_difference: bool = False

    def add(self, cell: Cell) -> None:
        self.cells[cell.row, cell.column] = cell

    def best(self, column: int) -> dict[int, set[str]]:
        """By row, the names of the figures at which it is best in its column."""
        own = [cell for cell in self.cells.values() if cell.column == column]
        found = best([cell.figures for cell in own]) if own else []
        return {cell.row: names for cell, names in zip(own, found, strict=True)}

    @property
    def scale(self) -> HeatScale:
        """Of distances, from 0 to the next 1, 2 or 5 of a power of ten beyond nearly all that is seen."""
        own = [cell.picture for cell in self.cells.values() if self.is_coloured(cell)]
        seen = np.concatenate([[0.0], *(each.values[each.pixels[..., 3] > 0.0] for each in own)])
        seen = seen[np.isfinite(seen)]
        widths = [cell.width for cell in self.cells.values()]
        most = max(float(np.quantile(seen, NEARLY_ALL)), LEAST_RANGE * max(widths, default=1.0))
        power = 10.0 ** np.floor(np.log10(most))
        end = next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= most * (1.0 - 1e-6))
        return HeatScale(METRICS["distance"], 0.0, float(end), bool(seen.max() > end))

    def is_coloured(self, cell: Cell) -> bool:
        return self.is_difference and cell.row > 0

    def pixels(self, cell: Cell, scale: HeatScale) -> np.ndarray:
        """float32 [size, size, 4], RGBA in 0..1, opaque, from the bottom row up"""
        found = cell.picture.pixels
        if self.is_coloured(cell):
            found = cell.picture.coloured(lambda values: colours(values / scale.high))
        cloth = np.array((*CLOTH, 1.0), np.float32)
        return cloth + found[..., 3:] * (found - cloth)


def colours(shares: np.ndarray) -> np.ndarray:
    """float64 [n, 3], sRGB in 0..1: the heat map's, over clay where the difference is small, so that the
    shape stays legible."""
    # Where a shape is not finite, they are not numbers.
    shares = np.fmin(shares, 2.0)
    opaque = np.clip(shares / FADES, 0.0, 1.0)[:, None]
    return FRONT + opaque * (viridis(shares) - FRONT)
