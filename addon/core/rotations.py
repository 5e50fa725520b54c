# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations as quaternions (w, x, y, z), stored component by component: [4, n]. `sinew` does the
arithmetic."""

import numpy as np
import sinew


def rotations_of(motions: np.ndarray) -> np.ndarray:
    """Unit quaternions, float64 [4, n], of the rotations nearest to the linear parts `motions` [n, 3, 3]."""
    affine = np.zeros((len(motions), 3, 4))
    affine[:, :, :3] = motions
    return np.ascontiguousarray(sinew.affine.to_dual_quat(sinew.affine.normalized(affine))[:, :4].T)


def rotated(quaternions: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Returns vectors [3, n] rotated by quaternions [4, n] of any length except 0; both have the same element
    type."""
    pairs = np.zeros((quaternions.shape[1], 7), quaternions.dtype)
    pairs[:, :4] = quaternions.T
    rows = sinew.quat_vec.transform_vector(sinew.quat_vec.normalized(pairs), np.ascontiguousarray(vectors.T))
    return rows.T
