# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms points to other spaces."""

import numpy as np
import sinew

# The identity; is_same_space() recognises this object without comparing numbers.
SAME_SPACE = np.identity(4)


def transformed(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Returns `points` [n, 3] transformed by `matrix` [4, 4], affine; float64 [n, 3]."""
    # Not with numpy's product: its BLAS uses threads even for so small a matrix, and these wait for each
    # other, which takes up to a hundred times as long on a busy machine.
    return sinew.affine.transform_point(matrix.astype(np.float64), points.astype(np.float64))


def transformed_axes(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """The same as float64 [3, n], the layout of metrics.py."""
    x, y, z = points.T.astype(np.float64)
    columns = matrix[:3, :, np.newaxis]
    return columns[:, 0] * x + columns[:, 1] * y + columns[:, 2] * z + columns[:, 3]


def is_same_space(matrix: np.ndarray) -> bool:
    return matrix is SAME_SPACE or np.array_equal(matrix, SAME_SPACE)
