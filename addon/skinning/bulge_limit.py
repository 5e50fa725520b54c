# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage bulge_limit of one mesh."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import sinew

from .bone_stage import BoneStage
from .rig import Bones, Weighting


def segments(bones: Bones) -> tuple[np.ndarray, np.ndarray]:
    """Returns heads and tails at rest, float32 [bones + joints, 3], armature space.

    A joint of a bendy bone gets its two adjacent segments as one: so a vertex between two joints is compared
    with the segments of both.
    """
    heads = bones.rest[:, :3, 3].copy()
    tails = heads.copy()
    count = len(bones.names)
    tails[:count] += bones.limbs.vectors.astype(np.float32)
    for bone, number in bones.bending:
        first = bones.first_joints[bone]
        joints = bones.rest[first : first + number + 1, :3, 3]
        heads[first : first + number + 1] = np.vstack([joints[:1], joints[:-1]])
        tails[first : first + number + 1] = np.vstack([joints[1:], joints[-1:]])
    return heads, tails


class BulgeLimit(BoneStage[sinew.BulgeLimit]):
    def _make(
        self, binding: sinew.Binding, weighting: Weighting, space: np.ndarray, weights: np.ndarray | None
    ) -> sinew.BulgeLimit:
        return sinew.BulgeLimit(binding, *segments(weighting.bones), bones_from_model=space, weights=weights)

    def _run(self, points: np.ndarray, motions: np.ndarray, values: Mapping[str, Any], frame: Any) -> None:
        self._native.apply(points, motions, points, strength=values["strength"], form=values["form"])
