# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic on arrays of vectors stored component by component, [k, n]."""

import numpy as np


def dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """[n]: dot products of [k, n]."""
    return np.einsum("ij,ij->j", a, b)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of [3, n]: several times faster than numpy's own on rows."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
