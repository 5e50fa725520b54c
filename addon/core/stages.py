# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages that follow the blend of the bones' motions, in their order. The mix is part of that blend."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import sinew

from .delta_mush import DeltaMush
from .stage_mesh import StageMesh

StageValues = Mapping[str, Mapping[str, Any]]
"""For each stage that is on its parameters by their ids, but for vertex groups."""


class Stage(Protocol):
    """Made of a StageMesh and the weights of the stage's vertex group: float32 [vertices], None for none."""

    def apply(
        self, points: np.ndarray, values: Mapping[str, Any], rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        """Changes `points` in place: float32 [vertices, 3], object space, C-contiguous.

        values       of its parameters in this frame
        rest_points  float32 [vertices, 3], what the bones deformed
        frames       a SkinStageFrame for each Armature modifier, None for one that took no part
        """


STAGES: dict[str, Callable[[StageMesh, np.ndarray | None], Stage]] = {"delta_mush": DeltaMush}
"""Those that follow the blend; the library's list has their order."""

ORDER = [stage.name for stage in sinew.stages() if stage.name in STAGES]


@dataclass
class StagesAfter:
    """All stages of one mesh that follow the blend, each made where it is first used.

    masks  float32 [vertices], the weights of the stage's vertex group, by the stage's name
    """

    mesh: StageMesh
    masks: Mapping[str, np.ndarray]
    _made: dict[str, Stage] = field(default_factory=dict)

    def another(self) -> StagesAfter:
        """The same for a thread, or a shape, of its own."""
        return StagesAfter(self.mesh, self.masks)

    def set_mesh(self, mesh: StageMesh) -> bool:
        """False where it equals the one before."""
        if mesh.equals(self.mesh):
            return False
        self.mesh = mesh
        self._made.clear()
        return True

    def apply(
        self, points: np.ndarray, values: StageValues, rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        """As Stage.apply(), by all that are in `values`."""
        for name in ORDER:
            if name in values:
                if name not in self._made:
                    self._made[name] = STAGES[name](self.mesh, self.masks.get(name))
                self._made[name].apply(points, values[name], rest_points, frames)
