# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms fitted to points by least squares, by each representation, in float64 and without weights.

source, target: [sets, n, 3], points.
"""

from __future__ import annotations

import numpy as np
import sinew


def kabsch(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """[sets, 4, 4], by singular values of the covariance (Kabsch 1976; Umeyama 1991)."""
    middles = [points.mean(axis=1, keepdims=True) for points in (source, target)]
    covariance = np.einsum("npi,npj->nij", target - middles[1], source - middles[0])
    u, _, v = np.linalg.svd(covariance)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
    fits = np.broadcast_to(np.eye(4), (len(source), 4, 4)).copy()
    fits[:, :3, :3] = u @ v
    fits[:, :3, 3] = middles[1][:, 0] - np.einsum("nij,nj->ni", u @ v, middles[0][:, 0])
    return fits


def horn(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """[sets, 7], the rotation as an eigenvector of a 4x4 matrix (Horn 1987)."""
    middles = [points.mean(axis=1) for points in (source, target)]
    p, q = source - middles[0][:, None], target - middles[1][:, None]
    s = np.einsum("npi,npj->nij", p, q)
    skew = np.stack([s[:, i, j] - s[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    trace = np.trace(s, axis1=1, axis2=2)
    matrix = np.empty((len(s), 4, 4))
    matrix[:, 0, 0], matrix[:, 0, 1:], matrix[:, 1:, 0] = trace, skew, skew
    matrix[:, 1:, 1:] = s + np.swapaxes(s, 1, 2) - trace[:, None, None] * np.eye(3)
    rotations = np.linalg.eigh(matrix)[1][:, :, 3]
    return np.hstack([rotations, middles[1] - sinew.quat.rotate(rotations, middles[0])])


def walker(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """[sets, 8], rotation and translation at once, as r + e s (Walker, Shao, Volz 1991).

    The squared distance of a pair is |q r - r p - 2 s|^2, whose argument is linear in r and s. The best s is
    linear in r, and r is an eigenvector."""
    middles = [points.mean(axis=1, keepdims=True) for points in (source, target)]
    p, q = source - middles[0], target - middles[1]
    (dx, dy, dz), (cx, cy, cz) = np.moveaxis(q - p, -1, 0), np.moveaxis(q + p, -1, 0)
    zero = np.zeros_like(dx)
    # The antisymmetric matrices that map r to q r - r p.
    rows = [[zero, -dx, -dy, -dz], [dx, zero, -cz, cy], [dy, cz, zero, -cx], [dz, -cy, cx, zero]]
    of_pairs = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    total = of_pairs.sum(axis=1)
    squares = np.swapaxes(of_pairs, -1, -2) @ of_pairs
    reduced = squares.sum(axis=1) - np.swapaxes(total, -1, -2) @ total / source.shape[1]
    r = np.linalg.eigh(reduced)[1][:, :, 0]
    s = (total @ r[:, :, None])[:, :, 0] / (2 * source.shape[1])
    to_middle, from_middle = (
        sinew.dual_quat.from_translation(sign * middle[:, 0])
        for sign, middle in zip((1, -1), middles[::-1], strict=True)
    )
    about = sinew.dual_quat.normalized(np.hstack([r, s]))
    return sinew.dual_quat.compose(to_middle, sinew.dual_quat.compose(about, from_middle))
