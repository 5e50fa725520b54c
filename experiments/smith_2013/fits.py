# SPDX-License-Identifier: GPL-3.0-or-later
"""The least squares of sinew.fit.rigid by matrices and by dual quaternions, in float64 and without weights.

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
