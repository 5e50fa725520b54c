# SPDX-License-Identifier: GPL-3.0-or-later
"""Orthographic cameras: of a whole mesh, or close to one of its vertices."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...skinning.vectors import unit

# A little from the character's left and from above, relative to Blender's front view (-Y).
VIEW_DIRECTION = np.array([0.45, -1.0, 0.22]) / np.linalg.norm([0.45, -1.0, 0.22])
# The share of the mesh's diagonal that close-ups show.
CLOSE_UP = 0.28
# The cosine of the angle up to which a rotation about a limb is a twist; the share of the whole view's
# direction in a view along an axis; the room around a joint, as a share of its size; the share of a mesh that
# hides nothing of note.
ALONG, TILT, JOINT_MARGIN, HIDES = 0.8, 0.2, 0.04, 0.02


@dataclass(frozen=True)
class View:
    """An orthographic camera.

    direction  unit, from the target towards the camera
    target     the point in the centre of the picture
    width      of the visible region, from left to right
    height     of the visible region, from bottom to top
    depth      how far before and behind the target is visible
    """

    direction: np.ndarray
    target: np.ndarray
    width: float
    height: float
    depth: float

    def pixels(self, size: int) -> tuple[int, int]:
        """Width and height of a picture whose longer side has `size` pixels."""
        longer = max(self.width, self.height)
        return round(size * self.width / longer), round(size * self.height / longer)


def whole_view(extents: Sequence[np.ndarray]) -> View:
    """Returns a view from the front of everything within `extents`, each as seen_extent() returns it."""
    direction = VIEW_DIRECTION
    low, high = np.min([e[0] for e in extents], axis=0), np.max([e[1] for e in extents], axis=0)
    centre = (low + high) / 2
    right, up = camera_axes(direction)
    target = centre[0] * right + centre[1] * up + centre[2] * direction
    width, height, depth = (float(size) for size in high - low)
    longer = max(width, height, 1e-6)
    width, height = max(width, longer / 2), max(height, longer / 2)
    return View(direction, target, width + 0.06 * longer, height + 0.06 * longer, depth + longer)


def seen_extent(points: np.ndarray) -> np.ndarray:
    """float64 [2, 3]: the lowest and highest coordinates of `points` [n, 3] along the whole view's right, up
    and direction."""
    seen = points @ np.stack([*camera_axes(VIEW_DIRECTION), VIEW_DIRECTION], axis=1)
    return np.stack([seen.min(axis=0), seen.max(axis=0)])


def of_one_size(views: Sequence[View]) -> list[View]:
    """Returns the views, each as wide, high and deep as the largest, so that they can be compared by eye."""
    largest = {name: max(getattr(view, name) for view in views) for name in ("width", "height", "depth")}
    return [replace(view, **largest) for view in views]


def close_view(points: np.ndarray, targets: np.ndarray) -> View:
    """Returns a view close to all of `targets` [n, 3], from the direction in which the fewest of `points` [m,
    3] are in front.

    targets  the positions of one vertex under each method: all are in the picture
    """
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    low, high = targets.min(axis=0), targets.max(axis=0)
    target = (low + high) / 2
    radius = max(0.5 * CLOSE_UP * diagonal, 0.75 * float(np.linalg.norm(high - low)))
    return View(_clearest_direction(points - target, radius), target, 2 * radius, 2 * radius, diagonal)


def joint_view(points: np.ndarray, targets: np.ndarray, axis: np.ndarray, limb: np.ndarray) -> View:
    """Returns a square view of all of `targets` [m, 3] from the side: along the axis that a joint is rotated
    about, or across the limb where that is the axis.

    points      [n, 3], what may hide them
    axis, limb  [3], unit
    """
    low, high = targets.min(axis=0), targets.max(axis=0)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    if abs(axis @ limb) > ALONG:
        right, up = camera_axes(limb)
        angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
        sides = [np.cos(angle) * right + np.sin(angle) * up for angle in angles]
    else:
        # A little of its depth is seen, too.
        sides = [unit(sign * axis + TILT * VIEW_DIRECTION) for sign in (1.0, -1.0)]
    direction = _clearest(points - centre, radius, sides, HIDES)
    seen = targets @ np.stack([*camera_axes(direction), direction], axis=1)
    low, high = seen.min(axis=0), seen.max(axis=0)
    right, up = camera_axes(direction)
    middle = (low + high) / 2
    size = (1.0 + 2.0 * JOINT_MARGIN) * max(float((high - low)[:2].max()), 1e-6)
    target = middle[0] * right + middle[1] * up + middle[2] * direction
    return View(direction, target, size, size, float(np.linalg.norm(np.ptp(points, axis=0))) + size)


def _clearest_direction(points: np.ndarray, radius: float) -> np.ndarray:
    """As _clearest(), among directions all around."""
    azimuth, elevation = np.meshgrid(np.linspace(0, 2 * np.pi, 16, endpoint=False), np.radians([10, 35, -15]))
    directions = np.stack(
        [np.sin(azimuth) * np.cos(elevation), -np.cos(azimuth) * np.cos(elevation), np.sin(elevation)],
        axis=-1,
    )
    return _clearest(points, radius, [VIEW_DIRECTION, *directions.reshape(-1, 3)])


def _clearest(
    points: np.ndarray, radius: float, candidates: Sequence[np.ndarray], alike: float = 0.0
) -> np.ndarray:
    """The one of the directions, unit, from which the origin is least hidden; of equals, the one nearest to
    the whole view's.

    `points` hide the origin where they are in front of the sphere of `radius` around it.

    alike  a share of the points that makes no difference
    """

    def hidden(direction: np.ndarray) -> float:
        along = points @ direction
        across = np.linalg.norm(points - np.outer(along, direction), axis=1)
        count = np.count_nonzero((along > 0.6 * radius) & (across < 0.6 * radius))
        return float(count // max(alike * len(points), 1.0))

    return min(candidates, key=lambda direction: (hidden(direction), -float(direction @ VIEW_DIRECTION)))


def camera_axes(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right and up of a camera in `direction` from its target, with up as near to +Z as possible."""
    world_up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(world_up, direction)
    right /= np.linalg.norm(right)
    return right, np.cross(direction, right)
