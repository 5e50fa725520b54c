# SPDX-License-Identifier: GPL-3.0-or-later
"""What an Armature modifier's options mean for Sinew, and which it does not reproduce."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..core.influences import GroupWeights


@dataclass(frozen=True)
class ModifierOptions:
    """The options that Sinew reproduces."""

    use_vertex_groups: bool
    mask: str
    invert_mask: bool

    @classmethod
    def read(cls, modifier: bpy.types.ArmatureModifier) -> ModifierOptions:
        return cls(modifier.use_vertex_groups, modifier.vertex_group, modifier.invert_vertex_group)

    def groups(self, weights: GroupWeights) -> GroupWeights:
        """The vertex groups that deform: none where the modifier is told to leave them."""
        if self.use_vertex_groups:
            return weights
        return GroupWeights(np.zeros_like(weights.counts), weights.groups[:0], weights.weights[:0])

    def mask_weights(self, obj: bpy.types.Object, weights: GroupWeights) -> np.ndarray | None:
        """float32 [vertices], the share of the deformation each vertex takes; None for all of it.

        A mask that names no group, or on a mesh without any weights, is ignored, as Blender does.
        """
        group = obj.vertex_groups.get(self.mask) if self.mask else None
        if group is None or len(weights.groups) == 0:
            return None
        mask = weights.of_group(group.index)
        return 1.0 - mask if self.invert_mask else mask


def differences(
    obj: bpy.types.Object, modifier: bpy.types.ArmatureModifier, armature: bpy.types.Object, bare: int
) -> list[str]:
    """A sentence for each thing that the modifier does and Sinew does not.

    bare  how many vertices have no weights
    """
    found = []
    deforming = [bone for bone in armature.data.bones if bone.use_deform]
    if modifier.use_multi_modifier:
        found.append(f"{modifier.name} is a Multi Modifier, which Sinew treats as a plain one")
    if modifier.use_bone_envelopes and bare:
        found.append(
            f"{modifier.name} moves vertices without weights by bone envelopes, which Sinew does not"
        )
    if modifier.use_vertex_groups and any(bone.use_envelope_multiply for bone in deforming):
        found.append("Bones with Envelope Multiply: Sinew uses their weights alone")
    if any(bone.bbone_segments > 1 and bone.bbone_mapping_mode == "CURVED" for bone in deforming):
        found.append("Bendy bones with curved mapping: Sinew maps them straight")
    others = [
        m.name for m in obj.modifiers if m.type == "ARMATURE" and m != modifier and m.object is not None
    ]
    if others:
        found.append(f"Further Armature modifiers stay Blender's: {', '.join(others)}")
    return found
