# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays that may be None compared; arrays read from Blender's collections."""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np


def are_equal(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    """Whether both are None, or both have the same shape and numbers."""
    return a is b or (a is not None and b is not None and np.array_equal(a, b))


@dataclass(frozen=True)
class OfArrays:
    """A record whose fields are arrays, tuples or other such records; or None. Fields that are not compared
    are made of something else."""

    def equals(self, other: Self) -> bool:
        pairs = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self) if f.compare)
        return self is other or all(
            a.equals(b) if isinstance(a, OfArrays) else a == b if isinstance(a, tuple) else are_equal(a, b)
            for a, b in pairs
        )


def read(elements: Any, name: str, width: int = 1, kind: type = np.float32) -> np.ndarray:
    """Returns a property of all elements of one of Blender's collections, a copy: [elements], or
    [elements, width] for a property of several numbers.

    kind  that of Blender's own array, or reading takes many times as long
    """
    values: np.ndarray = np.empty((len(elements), width), kind)
    elements.foreach_get(name, values.ravel())
    return values if width > 1 else values[:, 0]
