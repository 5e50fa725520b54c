# SPDX-License-Identifier: GPL-3.0-or-later
"""What methods keep of each vertex of one bound mesh, made where a method is first used and kept."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

import numpy as np
import sinew

from .rig import Weighting
from .spaces import transformed

# What makes the data of a method: of rest points, influences (offsets, bones, weights) and triangles.
PROVIDERS: dict[str, Callable[..., np.ndarray | None]] = {"cor": sinew.centres_of_rotation}


class VertexData:
    """Of a mesh at rest, without shape keys. Any thread may ask.

    weighting  of the bones that move the mesh
    points     float32 [vertices, 3], object space
    triangles  int32 [triangles, 3]
    given      what is not made here but read from the mesh, by the name of the method
    """

    def __init__(
        self,
        weighting: Weighting,
        points: np.ndarray,
        triangles: np.ndarray,
        given: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        self.weighting = weighting
        self.points = points
        self.triangles = triangles
        self._given = dict(given or {})
        self._made: dict[str, np.ndarray] = {}
        self._lock = threading.Lock()

    @property
    def is_used(self) -> bool:
        return bool(self._made or self._given)

    def of(self, method: str, bones_from_model: np.ndarray) -> np.ndarray | None:
        """float32 [vertices, Method.vertex_floats], object space; None for a method that keeps nothing.

        bones_from_model  float64 [4, 4], where weights depend on where vertices are: the first call decides
        """
        if method in self._given:
            return self._given[method]
        provider = PROVIDERS.get(method)
        if provider is None:
            return None
        with self._lock:
            if method not in self._made:
                self._made[method] = self._make(provider, bones_from_model)
            return self._made[method]

    def _make(self, provider: Callable[..., np.ndarray | None], bones_from_model: np.ndarray) -> np.ndarray:
        points = self.points
        if self.weighting.depends_on_points:
            points = transformed(points, bones_from_model)
        influences = self.weighting.influences_over_joints(points)
        made = provider(self.points, influences.offsets, influences.bones, influences.weights, self.triangles)
        assert made is not None, "nothing cancels it"
        return made
