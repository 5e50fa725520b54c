# SPDX-License-Identifier: GPL-3.0-or-later
"""The mix of relative shape keys, which Blender applies before all modifiers."""

from dataclasses import dataclass

import numpy as np

from .arrays import OfArrays


@dataclass(frozen=True)
class ShapeKeys(OfArrays):
    """The relative shape keys of a mesh.

    names   of all keys, in order
    basis   float32 [vertices, 3]
    deltas  one for each key: None for the basis, else float32 [vertices, 3], its offsets at value 1
    """

    names: tuple[str, ...]
    basis: np.ndarray
    deltas: tuple[np.ndarray | None, ...]

    def mix(self, values: np.ndarray) -> np.ndarray:
        """float32 [vertices, 3] with each key at its value; a muted key's value is 0."""
        points = self.basis.copy()
        for delta, value in zip(self.deltas, values, strict=True):
            if delta is not None and value != 0.0:
                points += np.float32(value) * delta
        return points
