# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a property of all elements of one of Blender's collections at once."""

import bpy
import numpy as np


def read(
    elements: bpy.types.bpy_prop_collection, name: str, width: int = 1, kind: type = np.float32
) -> np.ndarray:
    """Returns [elements], or [elements, width] for a property of several numbers; a copy.

    kind  that of Blender's own array, or reading takes many times as long
    """
    values = np.empty((len(elements), width), kind)
    elements.foreach_get(name, values.ravel())
    return values if width > 1 else values[:, 0]
