# SPDX-License-Identifier: GPL-3.0-or-later
"""Text in pictures, by the font that Blender has, on every version and without a graphics card."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import shaded

# Samples of a pixel in each direction.
SAMPLES = 4
# The height of a letter's square above its line, and below, as parts of its size; and what a text of size 1
# of Blender's measures less than one of an interface.
ABOVE, BELOW, SIZE = 1.0, 0.35, 1.15


@dataclass
class Letters:
    """Draws texts of one size, in pixels; keeps what it has drawn of each letter."""

    size: int
    _curve: bpy.types.TextCurve
    _obj: bpy.types.Object
    _known: dict[str, tuple[np.ndarray, float]] = field(default_factory=dict)

    def width(self, text: str) -> float:
        return sum(self._letter(letter)[1] for letter in text)

    def draw(
        self, pixels: np.ndarray, left: float, top: float, text: str, colour: tuple[float, float, float]
    ) -> None:
        """pixels: float32 [height, width, 3], from the top; `top` is that of the line"""
        for letter in text:
            cover, wide = self._letter(letter)
            x, y = round(left), round(top)
            part = pixels[max(y, 0) : max(y + len(cover), 0), max(x, 0) : max(x + len(cover), 0)]
            # It may be cut off at any side.
            seen = cover[max(-y, 0) :, max(-x, 0) :]
            share = seen[: part.shape[0], : part.shape[1], None]
            part += share * (np.array(colour, np.float32) - part)
            left += wide

    def _letter(self, letter: str) -> tuple[np.ndarray, float]:
        """float32 [n, n], from the top, how much of each pixel it covers; and how far the next one is."""
        if letter not in self._known:
            wide = self.size * SIZE * (self._extent(f"x{letter}x") - self._extent("xx"))
            self._known[letter] = self._covered(letter), wide
        return self._known[letter]

    def _extent(self, text: str) -> float:
        points, _triangles = self._read(text)
        return float(np.ptp(points[0])) if points.size else 0.0

    def _covered(self, letter: str) -> np.ndarray:
        points, triangles = self._read(letter)
        wide = int(np.ceil((ABOVE + BELOW) * self.size * SIZE)) + 1
        across = wide * SAMPLES
        whole, seen = np.zeros(across * across, np.float32), np.zeros((3, points.shape[1]))
        seen[:2] = points[:2] * self.size * SIZE * SAMPLES - 0.5
        seen[1] += BELOW * self.size * SAMPLES
        triangles = triangles[:, shaded.are_wide(seen[:2, triangles])]
        if triangles.size:
            whole[shaded.nearest(seen, triangles, across)[0]] = 1.0
        return whole.reshape(wide, SAMPLES, wide, SAMPLES).mean(axis=(1, 3))[::-1]

    def _read(self, text: str) -> tuple[np.ndarray, np.ndarray]:
        """float64 [3, n], of size 1; int [3, triangles]."""
        self._curve.body = text
        mesh = self._obj.to_mesh()
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        mesh.calc_loop_triangles()
        triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        self._obj.to_mesh_clear()
        return points.reshape(-1, 3).T.astype(float), triangles.reshape(-1, 3).T


@contextmanager
def letters(*sizes: int) -> Iterator[list[Letters]]:
    """Context with letters of these sizes; nothing of it stays in the file."""
    fonts = list(bpy.data.fonts)
    curve = bpy.data.curves.new("Letters", "FONT")
    obj, font = bpy.data.objects.new("Letters", curve), curve.font
    try:
        yield [Letters(size, curve, obj) for size in sizes]
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.curves.remove(curve)
        # Blender's own font became a datablock.
        if font not in fonts and not font.users:
            bpy.data.fonts.remove(font)
