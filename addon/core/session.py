# SPDX-License-Identifier: GPL-3.0-or-later
"""One driven mesh between frames: its bound deformer, what it was last deformed with, and the result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sinew

from .rig import Weighting

IDENTITY = np.identity(4)


@dataclass
class Frame:
    """What decides the shape of one frame.

    method            name of a method
    pose              float32 [bones + joints, 4, 4], armature space, as Blender gives it
    bones_from_model  float64 [4, 4], takes the mesh's object space to armature space
    rest_points       float32 [vertices, 3], object space, shape keys applied
    """

    method: str
    pose: np.ndarray
    bones_from_model: np.ndarray
    rest_points: np.ndarray


class Binding:
    """A mesh bound to bones. Deforms when a frame differs from the last."""

    def __init__(self, weighting: Weighting, mask: np.ndarray | None = None) -> None:
        """mask: float32 [vertices], the share of the deformation each vertex takes; None for all of it."""
        self.weighting = weighting
        self.bones = weighting.bones
        self.mask = mask
        self._rest_from_armature = np.linalg.inv(self.bones.rest.astype(np.float64))
        self._deformer: sinew.Deformer | None = None
        self._last: Frame | None = None
        self._points = np.empty((len(weighting.entries.counts), 3), dtype=np.float32)

    @property
    def moving_bones(self) -> list[str]:
        """Names of the bones that can move a vertex."""
        bones = np.unique(self.weighting.entries.bones)
        if self.weighting.use_envelopes:
            bones = np.flatnonzero(self.bones.deform)
        return [self.bones.names[bone] for bone in bones]

    @property
    def last_frame(self) -> Frame | None:
        """What was deformed last."""
        return self._last

    @property
    def points(self) -> np.ndarray:
        """The result of the last call of deform, float32 [vertices, 3]."""
        return self._points

    def deform(self, frame: Frame) -> np.ndarray | None:
        """Deformed points float32 [vertices, 3] in object space, valid until the next call; None where the
        frame equals the last one."""
        last = self._last
        if last is not None and _same(last, frame):
            return None
        deformer = self._bound(frame)
        # In double: a bone far from the origin would lose digits in the product of two float matrices.
        posed_from_rest = frame.pose.astype(np.float64) @ self._rest_from_armature
        same_space = np.array_equal(frame.bones_from_model, IDENTITY)
        deformer.deform(
            posed_from_rest.astype(np.float32),
            out=self._points,
            bones_from_model=None if same_space else frame.bones_from_model.astype(np.float32),
        )
        if self.mask is not None:
            self._points -= frame.rest_points
            self._points *= self.mask[:, None]
            self._points += frame.rest_points
        self._last = frame
        return self._points

    def _bound(self, frame: Frame) -> sinew.Deformer:
        last = self._last
        reshaped = last is None or frame.rest_points is not last.rest_points
        moved = reshaped or not np.array_equal(frame.bones_from_model, last.bones_from_model)
        deformer = self._deformer
        if (
            deformer is None
            or deformer.method != frame.method
            or (moved and self.weighting.depends_on_points)
        ):
            space = frame.bones_from_model
            influences = self.weighting.influences_over_joints(
                frame.rest_points @ space[:3, :3].T + space[:3, 3]
            )
            self._deformer = sinew.Deformer(
                frame.rest_points,
                influences.offsets,
                influences.bones,
                influences.weights,
                frame.method,
                rest_bones=self.bones.rest_axes,
            )
        elif reshaped:
            deformer.set_rest_points(frame.rest_points)
        return self._deformer


def _same(a: Frame, b: Frame) -> bool:
    return (
        a.method == b.method
        and (a.rest_points is b.rest_points or np.array_equal(a.rest_points, b.rest_points))
        and np.array_equal(a.pose, b.pose)
        and np.array_equal(a.bones_from_model, b.bones_from_model)
    )
