# SPDX-License-Identifier: GPL-3.0-or-later
"""Points in other spaces."""

from __future__ import annotations

import numpy as np
import sinew


def transformed(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """`points` [n, 3] after `matrix` [4, 4], an affine transform; float64 [n, 3]."""
    # numpy leaves a product with so small a matrix to a BLAS whose threads wait for each other: up to a
    # hundred times as long on a busy machine.
    return sinew.affine.transform_point(matrix.astype(np.float64), points.astype(np.float64))
