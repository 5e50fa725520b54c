# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of a deformed mesh."""

from __future__ import annotations

import numpy as np


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Volume enclosed by a triangle mesh, in cubed units of `points`; positive where faces look outwards.

    points     [vertices, 3]
    triangles  int [triangles, 3]

    The sum of signed tetrahedra from the mesh's centre, by the divergence theorem. For an open mesh it is
    the volume closed by a cone from that centre over each hole.
    """
    if len(triangles) == 0:
        return 0.0
    centred = points.astype(np.float64) - points.mean(axis=0, dtype=np.float64)
    a, b, c = (centred[triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
