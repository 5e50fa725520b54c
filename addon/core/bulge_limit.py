# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage bulge_limit of one mesh."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sinew

from .rig import Bones, Weighting
from .scale_rule import IGNORED
from .spaces import transformed
from .stage_mesh import StageMesh


def segments(bones: Bones) -> tuple[np.ndarray, np.ndarray]:
    """Returns heads and tails at rest, float32 [bones + joints, 3], armature space.

    A joint of a bendy bone gets its two adjacent segments as one: so a vertex between two joints is compared
    with the segments of both.
    """
    heads = bones.rest[:, :3, 3].copy()
    tails = heads.copy()
    count = len(bones.names)
    tails[:count] += bones.lengths[:, None] * bones.rest_axes[:count, :3, 1]
    for bone, number in bones.bending:
        first = bones.first_joints[bone]
        joints = bones.rest[first : first + number + 1, :3, 3]
        heads[first : first + number + 1] = np.vstack([joints[:1], joints[:-1]])
        tails[first : first + number + 1] = np.vstack([joints[1:], joints[-1:]])
    return heads, tails


class BulgeLimit:
    """See core.stages.Stage. Uses the bones of the first Armature modifier that takes part."""

    def __init__(self, mesh: StageMesh, mask: np.ndarray | None) -> None:
        self._mesh = mesh
        self._mask = mask
        self._native: sinew.BulgeLimit | None = None
        # What the native stage is bound to.
        self._modifier = -1
        self._rest_points: np.ndarray | None = None
        self._space: np.ndarray | None = None
        # By the number of the Armature modifier.
        self._inverses: dict[int, np.ndarray] = {}

    def apply(
        self, points: np.ndarray, values: Mapping[str, Any], rest_points: np.ndarray, frames: Sequence[Any]
    ) -> None:
        modifier = next((i for i, frame in enumerate(frames) if frame is not None), None)
        if modifier is None:
            return
        frame, bones = frames[modifier], self._mesh.weightings[modifier].bones
        motions = frame.pose.astype(np.float64) @ self._rest_inverses(modifier)
        if frame.scale_rule == IGNORED.name:
            motions = sinew.affine.split_scale(motions, bones.rest_axes.astype(np.float64)).rigid
        self._bind(modifier, rest_points, frame.bones_from_model).apply(
            points, motions.astype(np.float32), points, strength=values["strength"], form=values["form"]
        )

    def _rest_inverses(self, modifier: int) -> np.ndarray:
        """Returns float64 [bones + joints, 4, 4]. Inverted only once: numpy's inversion uses its own threads,
        for which a frame would wait on a busy machine."""
        if modifier not in self._inverses:
            rest = self._mesh.weightings[modifier].bones.rest
            self._inverses[modifier] = np.linalg.inv(rest.astype(np.float64))
        return self._inverses[modifier]

    def _bind(self, modifier: int, rest_points: np.ndarray, bones_from_model: np.ndarray) -> sinew.BulgeLimit:
        weighting = self._mesh.weightings[modifier]
        is_same = (
            rest_points is self._rest_points
            and self._space is not None
            and np.array_equal(bones_from_model, self._space)
        )
        space = bones_from_model.astype(np.float32)
        if (
            self._native is None
            or modifier != self._modifier
            or (weighting.depends_on_points and not is_same)
        ):
            self._native = self._make(weighting, modifier, rest_points, bones_from_model)
        elif not is_same:
            self._native.set_rest_points(rest_points, space)
        self._modifier, self._rest_points, self._space = modifier, rest_points, bones_from_model.copy()
        return self._native

    def _make(
        self, weighting: Weighting, modifier: int, rest_points: np.ndarray, bones_from_model: np.ndarray
    ) -> sinew.BulgeLimit:
        points = rest_points
        if weighting.depends_on_points:
            points = transformed(points, bones_from_model)
        influences = weighting.influences_over_joints(points)
        return sinew.BulgeLimit(
            sinew.Binding(rest_points, influences.offsets, influences.bones, influences.weights),
            *segments(weighting.bones),
            bones_from_model=bones_from_model.astype(np.float32),
            weights=self._weights(modifier),
        )

    def _weights(self, modifier: int) -> np.ndarray | None:
        """Returns the vertex group's weights, with 0 where the Armature modifier's own mask keeps a vertex
        from following its bones: its distance from them means nothing."""
        follows = self._mesh.modifier_masks[modifier] if self._mesh.modifier_masks else None
        if follows is None:
            return self._mask
        whole = (follows >= 1.0).astype(np.float32)
        return whole if self._mask is None else whole * self._mask
