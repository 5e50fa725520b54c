# SPDX-License-Identifier: GPL-3.0-or-later
"""The positions of copies of a character beside it."""

import numpy as np

# The space between two characters, as a share of a character's width.
GAP = 0.12


def row_axis(right: np.ndarray) -> np.ndarray:
    """float64 [3]: the one of -X, +X, -Y and +Y that is nearest to `right` [3], which points to the right of
    the screen; +X where that is vertical."""
    axis = np.zeros(3)
    nearest = int(np.abs(right[:2]).argmax())
    axis[nearest] = -1.0 if right[nearest] < 0.0 else 1.0
    return axis


def spacing(points: np.ndarray, axis: np.ndarray) -> float:
    """The distance between neighbouring characters along `axis` [3]; 1 where they have no width along it.

    points  [n, 3], n > 0, the character's, or the corners of its bounding box
    """
    width = float(np.ptp(points @ axis))
    return (1.0 + GAP) * width if width > 0.0 else 1.0
