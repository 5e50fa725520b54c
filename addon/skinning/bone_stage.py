# SPDX-License-Identifier: GPL-3.0-or-later
"""What stages have in common that follow the bones of a mesh."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import sinew

from .rig import Weighting
from .scale_rule import IGNORED
from .stage_mesh import StageMesh


class HasRestPoints(Protocol):
    def set_rest_points(self, rest_points: np.ndarray, bones_from_model: np.ndarray) -> None: ...


Native = TypeVar("Native", bound=HasRestPoints)


class BoneStage(ABC, Generic[Native]):
    """See skinning.stages.Stage. Uses the bones of the first Armature modifier that takes part."""

    # From the first frame on.
    _native: Native

    def __init__(self, mesh: StageMesh, mask: np.ndarray | None) -> None:
        self._mesh = mesh
        self._mask = mask
        # What the native stage is bound to; -1 before the first frame.
        self._modifier = -1
        self._rest_points: np.ndarray | None = None
        self._space: np.ndarray | None = None
        # By the number of the Armature modifier.
        self._inverses: dict[int, np.ndarray] = {}

    @abstractmethod
    def _make(
        self, binding: sinew.Binding, weighting: Weighting, space: np.ndarray, weights: np.ndarray | None
    ) -> Native:
        """Returns the library's object for the stage, bound.

        space    float32 [4, 4], from object space to armature space
        weights  float32 [vertices] of the vertex group, None for none
        """

    @abstractmethod
    def _run(self, points: np.ndarray, motions: np.ndarray, values: Mapping[str, Any], frame: Any) -> None:
        """Applies it in place.

        motions  float32 [bones + joints, 4, 4], armature space
        frame    ModifierFrame
        """

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
        self._bind(modifier, rest_points, frame.bones_from_model)
        self._run(points, motions.astype(np.float32), values, frame)

    def _rest_inverses(self, modifier: int) -> np.ndarray:
        """Returns float64 [bones + joints, 4, 4]. Inverted only once: numpy's inversion uses its own threads,
        for which a frame would wait on a busy machine."""
        if modifier not in self._inverses:
            rest = self._mesh.weightings[modifier].bones.rest
            self._inverses[modifier] = np.linalg.inv(rest.astype(np.float64))
        return self._inverses[modifier]

    def _bind(self, modifier: int, rest_points: np.ndarray, bones_from_model: np.ndarray) -> None:
        weighting = self._mesh.weightings[modifier]
        is_same = (
            rest_points is self._rest_points
            and self._space is not None
            and np.array_equal(bones_from_model, self._space)
        )
        space = bones_from_model.astype(np.float32)
        if modifier != self._modifier or (weighting.depends_on_points and not is_same):
            binding = self._mesh.binding(modifier, rest_points, bones_from_model)
            self._native = self._make(binding, weighting, space, self._weights(modifier))
        elif not is_same:
            self._native.set_rest_points(rest_points, space)
        self._modifier, self._rest_points, self._space = modifier, rest_points, bones_from_model.copy()

    def _weights(self, modifier: int) -> np.ndarray | None:
        """Returns the vertex group's weights, with 0 where the Armature modifier's own mask keeps a vertex
        from following its bones: their position does not affect it."""
        follows = self._mesh.modifier_masks[modifier] if self._mesh.modifier_masks else None
        if follows is None:
            return self._mask
        whole = (follows >= 1.0).astype(np.float32)
        return whole if self._mask is None else whole * self._mask
