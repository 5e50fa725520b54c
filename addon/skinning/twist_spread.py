# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage twist_spread of one mesh."""

from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

import numpy as np
import sinew

from .bone_stage import BoneStage
from .rig import Weighting

TwistInputs = tuple[tuple[float, ...], ...]
"""For each of rig.Bones.twists: the bone's amount and curve, then the channels of its tip, as
sinew.TwistSpread.apply takes them: all 0 where they tell no turns."""

NOT_TOLD = (0.0,) * 7
# Methods that blend rotations otherwise than the shorter way by quaternions.
Blend: TypeAlias = Literal["linear", "matrices", "rotations", "logarithms"]
BLENDS: dict[str, Blend] = {"lbs": "linear", "ddm": "matrices", "log": "logarithms", "dib": "logarithms"}


def blend_of(method: str) -> Blend:
    return BLENDS.get(method, "rotations")


class TwistSpread(BoneStage[sinew.TwistSpread]):
    def _make(
        self, binding: sinew.Binding, weighting: Weighting, space: np.ndarray, weights: np.ndarray | None
    ) -> sinew.TwistSpread:
        bones, twists = weighting.bones, weighting.bones.twists
        return sinew.TwistSpread(
            binding,
            twists.rows,
            twists.heads,
            twists.tails,
            bones.rest_axes,
            parents=twists.parents,
            bones_from_model=space,
            weights=weights,
            mix=self._mesh.mix_weights,
        )

    def _run(self, points: np.ndarray, motions: np.ndarray, values: Mapping[str, Any], frame: Any) -> None:
        inputs = np.array(frame.twists, np.float32).reshape(-1, 2 + len(NOT_TOLD))
        is_told = len(inputs) == self._native.twist_count
        blend = blend_of(frame.method)
        self._native.apply(
            points,
            motions,
            points,
            amount=values["amount"],
            amounts=inputs[:, 0] if is_told else None,
            curves=inputs[:, 1] if is_told else None,
            channels=inputs[:, 2:] if is_told and values["turns"] else None,
            blend=blend,
            mix_blend=blend_of(frame.mix) if frame.mix else blend,
        )
