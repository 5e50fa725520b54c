# SPDX-License-Identifier: GPL-3.0-or-later
"""Comparison of arrays that may be None."""

import numpy as np


def are_equal(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    """Whether both are None, or both have the same shape and numbers."""
    return a is b or (a is not None and b is not None and np.array_equal(a, b))
