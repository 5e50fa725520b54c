# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays that may be missing."""

from __future__ import annotations

import numpy as np


def are_equal(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    """Whether both are missing, or neither is and they have the same shape and numbers."""
    return a is b or (a is not None and b is not None and np.array_equal(a, b))
