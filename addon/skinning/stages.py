# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages that follow the blend of the bones' motions, in their order. The mix is part of that blend."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import sinew

from .bulge_limit import BulgeLimit
from .delta_mush import DeltaMush
from .stage_mesh import StageMesh
from .twist_spread import TwistSpread

StageValues = Mapping[str, Mapping[str, Any]]
"""For each stage that is on, its parameters by their ids, without vertex groups."""


class Stage(Protocol):
    """Made from a StageMesh and the weights of the stage's vertex group: float32 [vertices], None for
    none."""

    def apply(
        self, points: np.ndarray, values: Mapping[str, Any], rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        """Changes `points` in place: float32 [vertices, 3], object space, C-contiguous.

        values       of its parameters in this frame
        rest_points  float32 [vertices, 3], the points that the bones deformed
        frames       a ModifierFrame for each Armature modifier, None for one that took no part
        """


STAGES: dict[str, Callable[[StageMesh, np.ndarray | None], Stage]] = {
    "twist_spread": TwistSpread,
    "bulge_limit": BulgeLimit,
    "delta_mush": DeltaMush,
}
"""The stages that follow the blend; the library's list has their order."""

ORDER = [stage.name for stage in sinew.stages() if stage.name in STAGES]


@dataclass
class StagesAfter:
    """All stages of one mesh that follow the blend, each made when it is first used.

    masks  float32 [vertices], the weights of the stage's vertex group, by the stage's name
    """

    mesh: StageMesh
    masks: Mapping[str, np.ndarray]
    _made: dict[str, Stage] = field(default_factory=dict)

    def another(self) -> StagesAfter:
        """Returns a copy for another thread or shape."""
        return StagesAfter(self.mesh, self.masks)

    def set_mesh(self, mesh: StageMesh) -> bool:
        """Sets the mesh. Returns False where it equals the previous one."""
        if mesh.equals(self.mesh):
            return False
        self.mesh = mesh
        self._made.clear()
        return True

    def apply(
        self, points: np.ndarray, values: StageValues, rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        """Applies all stages that are in `values`; see Stage.apply()."""
        for name in ORDER:
            if name in values:
                if name not in self._made:
                    self._made[name] = STAGES[name](self.mesh, self.masks.get(name))
                self._made[name].apply(points, values[name], rest_points, frames)
