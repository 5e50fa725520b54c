# SPDX-License-Identifier: GPL-3.0-or-later
"""What an Armature modifier's options mean for Sinew, and which options it does not reproduce."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..skinning.influences import GroupWeights, entries_of_bones
from ..skinning.rig import Bones, Weighting

NAMES = (
    "use_vertex_groups",
    "use_bone_envelopes",
    "vertex_group",
    "invert_vertex_group",
    "use_multi_modifier",
)


@dataclass(frozen=True)
class ModifierOptions:
    """The options that Sinew reproduces."""

    use_vertex_groups: bool
    use_envelopes: bool
    mask: str
    invert_mask: bool
    multi: bool

    @classmethod
    def read(cls, modifier: bpy.types.ArmatureModifier | None) -> ModifierOptions:
        """None stands for the parent type Armature, which has no modifier in the stack."""
        if modifier is None:
            return cls(True, True, "", False, False)
        return cls(*(getattr(modifier, name) for name in NAMES))

    def weighting(self, group_names: list[str], weights: GroupWeights, bones: Bones) -> Weighting:
        """Returns what deforms the mesh: its groups that have a bone, or no groups where the modifier does
        not use them."""
        used = bones if self.use_vertex_groups else Bones.none()
        bone_of_group = used.of_groups(group_names)
        return Weighting(bones, entries_of_bones(weights, bone_of_group), self.use_envelopes)

    def mask_weights(self, group_names: list[str], weights: GroupWeights) -> np.ndarray | None:
        """Returns float32 [vertices], the share of the deformation that each vertex gets; None for all of it.

        As in Blender, a mask is ignored if its group is missing or if the mesh has no weights.
        """
        if self.mask not in group_names or len(weights.groups) == 0:
            return None
        mask = weights.of_group(group_names.index(self.mask))
        return 1.0 - mask if self.invert_mask else mask
