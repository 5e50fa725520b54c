# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules for the scale of bones: all methods except linear blend move vertices by rigid motions only."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ScaleRule:
    """A way to treat scale.

    number  stored in .blend files: never changed and never reused
    """

    number: int
    name: str
    label: str
    description: str


# Each bone's scale moves the vertex, before the rigid motions are blended.
BLENDER_4 = ScaleRule(
    1,
    "4.0",
    "Bone by Bone",
    "Each bone scales the vertex about itself before its motion is blended: Blender's rule since 4.0",
)
# The scales are blended as matrices; the vertex is scaled once, then moved by the blended motion.
BLENDER_3 = ScaleRule(
    2,
    "3.x",
    "Blended First",
    "The bones' scales are blended first, then their motions: Blender's rule up to 3.6",
)
IGNORED = ScaleRule(
    3, "none", "Ignore Scale", "Bones rotate and translate vertices and never scale them, under every method"
)

SCALE_RULES = (BLENDER_4, BLENDER_3, IGNORED)
