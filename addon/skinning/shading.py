# SPDX-License-Identifier: GPL-3.0-or-later
"""The shading of a mesh, and its normals."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import sinew

from .arrays import OfArrays
from .stage_mesh import Topology

# The library's names of domains by Blender's.
_DOMAINS: dict[str, Literal["vertex", "corner"]] = {"POINT": "vertex", "CORNER": "corner"}


@dataclass(frozen=True)
class Shading(OfArrays):
    """What the normals of a mesh depend on, apart from its points and faces; None where it is not set.

    sharp_edges  bool [edges]
    sharp_faces  bool [faces], which are flat
    custom       int16 [corners, 2], custom normals relative to the computed ones
    """

    sharp_edges: np.ndarray | None = None
    sharp_faces: np.ndarray | None = None
    custom: np.ndarray | None = None


@dataclass(frozen=True)
class GivenNormals:
    """The normals that Sinew gives along with the points.

    domain                  POINT or CORNER: the elements that have normals; empty where Blender computes them
    are_skinned             skinned from the rest normals, not computed from the deformed surface
    are_for_viewport_alone  in renders Blender computes them
    """

    domain: str = ""
    are_skinned: bool = False
    are_for_viewport_alone: bool = False


NO_NORMALS = GivenNormals()


class SurfaceNormals:
    """Computes the normals of a mesh as Blender defines them. For an invalid mesh, as one whose faces lack
    edges, they are zeros, which mean no normals."""

    def __init__(self, count: int, topology: Topology, shading: Shading) -> None:
        try:
            self._normals: sinew.Normals | None = sinew.Normals(
                count,
                topology.face_offsets,
                topology.corner_vertices,
                topology.edges,
                sharp_edges=shading.sharp_edges,
                sharp_faces=shading.sharp_faces,
                custom_normals=shading.custom,
            )
        except ValueError:
            self._normals = None

    def write(self, points: np.ndarray, domain: str, out: np.ndarray) -> None:
        """Computes the normals.

        points  float32 [vertices, 3]
        domain  POINT or CORNER: the elements that have normals
        out     float32 [vertices or corners, 3], C-contiguous
        """
        if self._normals is None:
            out[:] = 0.0
        else:
            self._normals.compute(points, _DOMAINS[domain], out=out)
