# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage delta_mush of one mesh."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import sinew

from .stage_mesh import StageMesh
from .weld import Weld, weld

# Parameters of the binding: where a key changes one, it is bound again, in about the time of a frame.
BIND_PARAMETERS = ("iterations", "radius", "factor", "smooth_type", "pin_boundary")


class DeltaMush:
    """See skinning.stages.Stage."""

    def __init__(self, mesh: StageMesh, mask: np.ndarray | None) -> None:
        self._mesh = mesh
        self._mask = mask
        self._native: sinew.DeltaMush | None = None
        self._settings: tuple[Any, ...] = ()
        self._rest_points: np.ndarray | None = None
        self._weld: Weld | None = None

    def apply(
        self, points: np.ndarray, values: Mapping[str, Any], rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        own = self._mesh.rest_points
        native = self._bind(values, rest_points if own is None else own)
        if self._weld is None:
            native.apply(points, out=points, scale=values["scale"])
            return
        first, places = self._weld.first, self._weld.places
        standing = points[first]
        # Vertices of one place that shape keys move apart stay apart.
        points += (native.apply(standing, scale=values["scale"]) - standing)[places]

    def _bind(self, values: Mapping[str, Any], rest_points: np.ndarray) -> sinew.DeltaMush:
        settings = tuple(values[name] for name in (*BIND_PARAMETERS, "invert_group", "weld"))
        if self._native is not None and settings == self._settings and rest_points is self._rest_points:
            return self._native
        chosen = self._places if values["weld"] else None
        if chosen is not self._weld:
            self._native, self._weld = None, chosen
        bound, weights = rest_points, self._mask
        if weights is not None and values["invert_group"]:
            weights = 1.0 - weights
        if self._weld is not None:
            bound = bound[self._weld.first]
            weights = None if weights is None else weights[self._weld.first]
        arguments = {name: values[name] for name in BIND_PARAMETERS} | {"weights": weights}
        if self._native is None:
            topology = self._mesh.topology if self._weld is None else self._weld.topology(self._mesh.topology)
            self._native = sinew.DeltaMush(
                bound, topology.face_offsets, topology.corner_vertices, topology.edges, **arguments
            )
        else:
            self._native.bind(bound, **arguments)
        self._settings, self._rest_points = settings, rest_points
        return self._native

    @cached_property
    def _places(self) -> Weld | None:
        """The weld of the mesh; None where no two vertices are one."""
        mesh = self._mesh
        if mesh.rest_points is None:
            return None
        moved_by = [each.entries.influences() for each in mesh.weightings]
        return weld(mesh.rest_points, moved_by, (self._mask, *mesh.modifier_masks))
