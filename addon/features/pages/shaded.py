# SPDX-License-Identifier: GPL-3.0-or-later
"""Small shaded pictures of a shape, drawn without a graphics card."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...skinning.influences import items_of, owners_of
from ...skinning.vectors import dots
from ..measure.metrics import Shape
from .views import View, camera_axes

# Samples of a pixel, in each direction.
SAMPLES = 2
# How far outside of its triangle a sample may be, for rounding; as a share of it.
EDGE = 1e-4
# Over how many samples to each side normals are compared, and how much that lightens.
WIDTH, CAVITY = 2, 0.5
# How bright the darkest place is in a picture that is coloured by values.
DARKEST = 0.6
# sRGB; light comes from the upper left, behind the camera.
FRONT, BACK = np.array([0.80, 0.76, 0.71], np.float32), np.array([0.55, 0.30, 0.24], np.float32)
_LIGHT = (np.array([-0.45, 0.55, 0.70]) / np.linalg.norm([-0.45, 0.55, 0.70])).astype(np.float32)


@dataclass(frozen=True)
class Picture:
    """
    pixels  float32 [size, size, 4], RGBA in 0..1, from the bottom row up; transparent where nothing is
    light   float32 [size, size], how bright the surface is
    values  float32 [size, size], the mean of the vertices' values there, 0 where nothing is; empty without
            values
    """

    pixels: np.ndarray
    light: np.ndarray
    values: np.ndarray

    def coloured(self, colours: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Returns `pixels` in the colours of the values.

        colours  of values [n], sRGB [n, 3] in 0..1
        """
        found = self.pixels.copy()
        shade = DARKEST + (1.0 - DARKEST) * self.light.clip(0.0, 1.0)
        found[..., :3] = colours(self.values.ravel()).reshape(*self.values.shape, 3) * shade[..., None]
        return found


def empty(size: int) -> Picture:
    light = np.zeros((size, size), np.float32)
    return Picture(np.zeros((size, size, 4), np.float32), light, light)


def draw(shape: Shape, view: View, size: int, shown: np.ndarray | None = None) -> np.ndarray:
    """As picture(); its pixels alone."""
    return picture(shape, view, size, shown).pixels


def picture(
    shape: Shape,
    view: View,
    size: int,
    shown: np.ndarray | None = None,
    values: np.ndarray | None = None,
) -> Picture:
    """
    view    square
    shown   bool [triangles]; None: all
    values  [vertices], to be coloured by
    """
    across = size * SAMPLES
    right, up = camera_axes(view.direction)
    axes = np.stack([right, up, view.direction])
    seen = axes @ (shape.points - view.target[:, None])
    # In samples, with their middles at whole numbers.
    seen[:2] = (seen[:2] / view.width + 0.5) * across - 0.5
    corners = _corners_in(seen[:2], shape, across, shown)
    samples, triangles, shares = nearest(seen, corners, across)
    lit = axes @ _vertex_normals(shape)
    lit = (lit / np.maximum(np.sqrt(dots(lit, lit)), 1e-12)).astype(np.float32)
    normals = np.einsum("kcn,cn->kn", lit[:, corners[:, triangles]], shares)
    # What is seen from inside is another colour.
    (ax, bx, cx), (ay, by, cy) = seen[:2, corners]
    outwards = (bx - ax) * (cy - ay) > (cx - ax) * (by - ay)
    faces = np.where(outwards[triangles], np.float32(1.0), np.float32(-1.0))
    light = 0.35 + 0.65 * np.clip((_LIGHT @ normals) * faces, 0.0, 1.0)
    light *= 1.0 + _cavity(normals * faces, samples, across)
    shown_values = np.empty((0, 0), np.float32)
    colours = light[:, None] * np.where(faces[:, None] > 0.0, FRONT, BACK)
    cover = _shrunk(np.ones(len(samples), np.float32), samples, size)
    whole = np.maximum(cover, 1e-6)
    means = np.stack([_shrunk(channel, samples, size) for channel in (*colours.T, light)], axis=-1)
    means /= whole[..., None]
    if values is not None:
        of_samples = (values.astype(np.float32)[corners[:, triangles]] * shares).sum(axis=0)
        shown_values = _shrunk(of_samples, samples, size) / whole
    pixels = np.concatenate([means[..., :3], cover[..., None]], axis=2).clip(0.0, 1.0)
    return Picture(pixels, means[..., 3], shown_values)


def _shrunk(values: np.ndarray, samples: np.ndarray, size: int) -> np.ndarray:
    """float32 [size, size]: of each pixel the sum over its covered samples, as a share of all.

    values  [n], of the samples
    """
    whole = np.zeros((size * SAMPLES) ** 2, np.float32)
    whole[samples] = values
    squares = whole.reshape(size, SAMPLES, size, SAMPLES)
    # Several times as fast as their mean over two axes.
    parts = [squares[:, row, :, column] for row in range(SAMPLES) for column in range(SAMPLES)]
    return sum(parts[1:], parts[0]) / np.float32(SAMPLES * SAMPLES)


def _vertex_normals(shape: Shape) -> np.ndarray:
    """float64 [3, vertices], of any length."""
    count, corners = shape.surface.vertex_count, shape.surface.corners
    return np.stack([sum(np.bincount(corner, axis, count) for corner in corners) for axis in shape.normals])


def _corners_in(places: np.ndarray, shape: Shape, across: int, shown: np.ndarray | None) -> np.ndarray:
    """int64 [3, n]: the corners of triangles that are in the picture, and are no lines there."""
    corners = shape.surface.corners if shown is None else shape.surface.corners[:, shown]
    points = places[:, corners]
    low, high = points.min(axis=1), points.max(axis=1)
    is_in = ((high >= 0.0) & (low <= across - 1)).all(axis=0)
    return corners[:, is_in & are_wide(points)]


def are_wide(points: np.ndarray) -> np.ndarray:
    """bool [n]: triangles [2, 3, n] that are no lines."""
    (ax, bx, cx), (ay, by, cy) = points
    return np.abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) > 1e-9


def nearest(seen: np.ndarray, corners: np.ndarray, across: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the samples that are covered, and of each the nearest triangle with the shares of its corners
    [3, n].

    seen  float64 [3, vertices]: places in samples, and heights towards the camera
    """
    samples, owner, shares, height = _covered(seen, corners, across)
    found = np.full(across * across, -1)
    left = np.arange(len(samples))
    while len(left):
        # The last of equal samples stays.
        found[samples[left]] = left
        left = left[height[left] > height[found[samples[left]]]]
    covered = np.flatnonzero(found >= 0)
    taken = found[covered]
    b, c = shares[:, taken]
    return covered, owner[taken], np.stack([1.0 - b - c, b, c])


def _covered(
    seen: np.ndarray, corners: np.ndarray, across: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns the samples that triangles cover, from behind to the front; of each the triangle, the shares of
    its second and third corner [2, n], and the height."""
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = seen[:, corners]
    # Then most samples are right at once.
    order = np.argsort(az + bz + cz)
    ax, bx, cx, ay, by, cy, az, bz, cz = (each[order] for each in (ax, bx, cx, ay, by, cy, az, bz, cz))
    whole = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    first_row, tall = _span(
        np.ceil(np.minimum(np.minimum(ay, by), cy)), np.maximum(np.maximum(ay, by), cy), across
    )
    # Rows of samples; shares are linear along each.
    owner = owners_of(tall)
    y = items_of(first_row, tall)
    slopes = [((cy - ay) / whole)[owner], ((ay - by) / whole)[owner]]
    at_zero = [
        ((ax - cx) / whole)[owner] * (y - ay[owner]) - slopes[0] * ax[owner],
        ((bx - ax) / whole)[owner] * (y - ay[owner]) - slopes[1] * ax[owner],
    ]
    left, right = np.zeros(len(owner)), np.full(len(owner), across - 1.0)
    for share, slope in zip((*at_zero, 1.0 - sum(at_zero)), (*slopes, -sum(slopes)), strict=True):
        # Nothing of a row whose share is too small everywhere.
        end = np.divide(
            -EDGE - share, slope, out=np.where(share < -EDGE, np.inf, -np.inf), where=slope != 0.0
        )
        left = np.where(slope >= 0.0, np.maximum(left, end), left)
        right = np.where(slope < 0.0, np.minimum(right, end), right)
    first, wide = _span(np.ceil(left), right, across)
    row, column = owners_of(wide), items_of(np.zeros_like(wide), wide)
    b, c = (
        (share + slope * first).astype(np.float32)[row] + slope.astype(np.float32)[row] * column
        for share, slope in zip(at_zero, slopes, strict=True)
    )
    samples, owner = (y * across + first)[row] + column, owner[row]
    height = (az[owner] + b * (bz - az)[owner] + c * (cz - az)[owner]).astype(np.float32)
    return samples, order[owner], np.stack([b, c]), height


def _span(first: np.ndarray, last: np.ndarray, across: int) -> tuple[np.ndarray, np.ndarray]:
    """int64 [n]: the first samples from `first` to `last` that are in the picture, and how many there are."""
    low, high = first.clip(0, across), np.floor(last).clip(-1, across - 1)
    return low.astype(np.int64), (high - low + 1).clip(min=0).astype(np.int64)


def _cavity(normals: np.ndarray, samples: np.ndarray, across: int) -> np.ndarray:
    """float32 [n]: how much lighter each sample is on a ridge, and darker in a valley, by how the normals
    [3, n] differ across it on the screen."""
    whole = np.zeros((2, across * across), np.float32)
    whole[:, samples] = normals[:2]
    x, y = whole.reshape(2, across, across)
    bent = np.zeros((across, across), np.float32)
    bent[:, WIDTH:-WIDTH] += x[:, 2 * WIDTH :] - x[:, : -2 * WIDTH]
    bent[WIDTH:-WIDTH] += y[2 * WIDTH :] - y[: -2 * WIDTH]
    covered = np.zeros(across * across, bool)
    covered[samples] = True
    inside = covered.reshape(across, across).copy()
    for step in (WIDTH, -WIDTH):
        for axis in (0, 1):
            inside &= np.roll(covered.reshape(across, across), step, axis)
    return np.clip(CAVITY * np.where(inside, bent, 0.0).ravel()[samples], -0.5, 0.15)
