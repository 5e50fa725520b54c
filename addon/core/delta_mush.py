# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage delta_mush of one mesh."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sinew

from .stage_mesh import StageMesh

# Parameters of the binding: where a key changes one, it is bound again, in about the time of a frame.
BIND_PARAMETERS = ("iterations", "radius", "factor", "smooth_type", "pin_boundary")


class DeltaMush:
    """See core.stages.Stage."""

    def __init__(self, mesh: StageMesh, mask: np.ndarray | None) -> None:
        self._mesh = mesh
        self._mask = mask
        self._native: sinew.DeltaMush | None = None
        self._settings: tuple[Any, ...] = ()
        self._rest_points: np.ndarray | None = None

    def apply(
        self, points: np.ndarray, values: Mapping[str, Any], rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        own = self._mesh.rest_points
        self._bind(values, rest_points if own is None else own).apply(
            points, out=points, scale=values["scale"]
        )

    def _bind(self, values: Mapping[str, Any], rest_points: np.ndarray) -> sinew.DeltaMush:
        settings = tuple(values[name] for name in (*BIND_PARAMETERS, "invert_group"))
        if self._native is not None and settings == self._settings and rest_points is self._rest_points:
            return self._native
        weights = self._mask
        if weights is not None and values["invert_group"]:
            weights = 1.0 - weights
        arguments = {name: values[name] for name in BIND_PARAMETERS} | {"weights": weights}
        if self._native is None:
            topology = self._mesh.topology
            self._native = sinew.DeltaMush(
                rest_points, topology.face_offsets, topology.corner_vertices, topology.edges, **arguments
            )
        else:
            self._native.bind(rest_points, **arguments)
        self._settings, self._rest_points = settings, rest_points
        return self._native
