# SPDX-License-Identifier: GPL-3.0-or-later
"""Small shaded pictures of a shape, drawn without a graphics card."""

from __future__ import annotations

import numpy as np

from ...skinning.influences import items_of, owners_of
from ...skinning.vectors import cross, dots
from ..measure.metrics import Shape
from ..pages.views import View, camera_axes

# Samples of a pixel, in each direction.
SAMPLES = 2
# sRGB; light comes from the upper left, behind the camera.
FRONT, BACK = np.array([0.80, 0.76, 0.71]), np.array([0.55, 0.30, 0.24])
_LIGHT = np.array([-0.45, 0.55, 0.70]) / np.linalg.norm([-0.45, 0.55, 0.70])


def draw(shape: Shape, view: View, size: int) -> np.ndarray:
    """Returns float32 [size, size, 4], RGBA in 0..1, from the bottom row up; transparent where nothing is.

    view  square
    """
    across = size * SAMPLES
    right, up = camera_axes(view.direction)
    axes = np.stack([right, up, view.direction])
    seen = axes @ (shape.points - view.target[:, None])
    # In samples, with their middles at whole numbers.
    places = (seen[:2] / view.width + 0.5) * across - 0.5
    lit = axes @ _vertex_normals(shape)
    lit /= np.maximum(np.sqrt(dots(lit, lit)), 1e-12)
    corners = _corners_in(places, shape, across)
    triangles, samples, shares = _covered(places, corners, across)
    depth = (seen[2][corners[:, triangles]] * shares).sum(axis=0)
    # The nearest is drawn last.
    order = np.argsort(depth, kind="stable")
    triangles, samples, shares = triangles[order], samples[order], shares[:, order]
    normals = (lit[:, corners[:, triangles]] * shares).sum(axis=1)
    # What is seen from inside is another colour.
    faces = np.where(normals[2] >= 0.0, 1.0, -1.0)
    light = 0.35 + 0.65 * np.clip(dots(normals, _LIGHT[:, None] * np.ones_like(normals)) * faces, 0.0, 1.0)
    picture = np.zeros((across * across, 4), np.float32)
    picture[samples, :3] = light[:, None] * np.where(faces[:, None] > 0.0, FRONT, BACK)
    picture[samples, 3] = 1.0
    blocks = picture.reshape(size, SAMPLES, size, SAMPLES, 4).sum(axis=(1, 3))
    colours = blocks[..., :3] / np.maximum(blocks[..., 3:], 1.0)
    return np.concatenate([colours, blocks[..., 3:] / SAMPLES**2], axis=2).astype(np.float32)


def _vertex_normals(shape: Shape) -> np.ndarray:
    """float64 [3, vertices], of any length."""
    count, corners = shape.surface.vertex_count, shape.surface.corners
    return np.stack([sum(np.bincount(corner, axis, count) for corner in corners) for axis in shape.normals])


def _corners_in(places: np.ndarray, shape: Shape, across: int) -> np.ndarray:
    """int64 [3, n]: the corners of triangles that are in the picture, and are no lines there."""
    corners = shape.surface.corners
    low, high = (limit(places[:, corners], axis=1) for limit in (np.min, np.max))
    is_in = ((high >= 0.0) & (low <= across - 1)).all(axis=0)
    a, b, c = (np.vstack([places[:, corner], np.zeros(corners.shape[1])]) for corner in corners)
    return corners[:, is_in & (np.abs(cross(b - a, c - a)[2]) > 1e-9)]


def _covered(
    places: np.ndarray, corners: np.ndarray, across: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns a row for each sample of each triangle: the triangle, the sample, and the shares of its corners
    [3, n]."""
    points = places[:, corners]
    low = np.ceil(points.min(axis=1)).clip(0, across - 1).astype(np.int64)
    high = np.floor(points.max(axis=1)).clip(0, across - 1).astype(np.int64)
    wide, tall = np.maximum(high - low + 1, 0)
    counts = wide * tall
    triangles, number = owners_of(counts), items_of(np.zeros_like(counts), counts)
    x = low[0][triangles] + number % wide[triangles]
    y = low[1][triangles] + number // wide[triangles]
    (ax, bx, cx), (ay, by, cy) = points
    whole = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay))[triangles]
    second = ((x - ax[triangles]) * (cy - ay)[triangles] - (cx - ax)[triangles] * (y - ay[triangles])) / whole
    third = ((bx - ax)[triangles] * (y - ay[triangles]) - (x - ax[triangles]) * (by - ay)[triangles]) / whole
    shares = np.stack([1.0 - second - third, second, third])
    is_in = (shares >= -1e-9).all(axis=0)
    return triangles[is_in], (y * across + x)[is_in], shares[:, is_in]
