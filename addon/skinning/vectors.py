# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic on arrays of points, vectors and rotations, and their spaces. Vectors and rotations are stored
component by component, [k, n]; rotations as quaternions (w, x, y, z), [4, n]."""

import numpy as np
import sinew


def dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """[n]: dot products of [k, n]."""
    return np.einsum("ij,ij->j", a, b)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of [3, n]: several times faster than numpy's own on rows."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors by rows, [.., k], made of length 1; 0 stays 0."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def distances_from_axes(points: np.ndarray, heads: np.ndarray, along: np.ndarray) -> np.ndarray:
    """float64 [n]: of points [3, n] from an axis each, from its head [3, n] along [3, n] to its tail."""
    from_head = points - heads
    squared = dots(along, along)
    share = np.divide(dots(from_head, along), squared, out=np.zeros_like(squared), where=squared > 0.0)
    offset = from_head - share.clip(0.0, 1.0) * along
    return np.sqrt(dots(offset, offset))


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
