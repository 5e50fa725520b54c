# SPDX-License-Identifier: GPL-3.0-or-later
"""What stages know about the mesh that they are bound to."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import sinew

from .arrays import OfArrays, are_equal
from .rig import Weighting
from .vectors import transformed


@dataclass(frozen=True)
class Topology(OfArrays):
    """Faces and edges of a mesh.

    face_offsets     int32 [faces + 1], the first corner of each face, then the end
    corner_vertices  int32 [corners]
    edges            int32 [edges, 2]
    """

    face_offsets: np.ndarray
    corner_vertices: np.ndarray
    edges: np.ndarray


@dataclass(frozen=True)
class StageMesh:
    """The mesh of a stage.

    topology        as the first Armature modifier gets it
    rest_points     float32 [vertices, 3], object space: the mesh's own, without shape keys and modifiers;
                    None where upstream modifiers change the number of vertices: then each frame's rest points
                    are used
    weightings      of the Armature modifiers
    modifier_masks  float32 [vertices], the share of each Armature modifier's deformation that each vertex
                    gets, None for all of it; empty: none has a mask
    mix_weights     float32 [vertices], the share of the second method of the stage mix; None for no share
    """

    topology: Topology
    rest_points: np.ndarray | None
    weightings: Sequence[Weighting]
    modifier_masks: Sequence[np.ndarray | None] = ()
    mix_weights: np.ndarray | None = None
    # By the number of the Armature modifier: what the last binding was made for, and the binding.
    _bound: dict[int, tuple[np.ndarray, np.ndarray, sinew.Binding]] = field(default_factory=dict, repr=False)

    def binding(self, modifier: int, rest_points: np.ndarray, bones_from_model: np.ndarray) -> sinew.Binding:
        """Returns the mesh bound to an Armature modifier's bones: one for all stages that follow them."""
        if modifier in self._bound:
            points, space, binding = self._bound[modifier]
            if points is rest_points and np.array_equal(space, bones_from_model):
                return binding
        weighting, at = self.weightings[modifier], rest_points
        if weighting.depends_on_points:
            at = transformed(at, bones_from_model)
        influences = weighting.influences_over_joints(at)
        binding = sinew.Binding(rest_points, influences.offsets, influences.bones, influences.weights)
        self._bound[modifier] = rest_points, bones_from_model.copy(), binding
        return binding

    def equals(self, other: Self) -> bool:
        """Whether both have the same points and faces; both belong to the same Armature modifiers."""
        return are_equal(self.rest_points, other.rest_points) and self.topology.equals(other.topology)
