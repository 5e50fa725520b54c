# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex data of the method sdef, from the shape keys that mmd_tools stores."""

import numpy as np

from ..base.phrases import phrase
from .influences import Influences

METHOD = "sdef"
KEYS = ("mmd_sdef_c", "mmd_sdef_r0", "mmd_sdef_r1")
"""Shape keys whose points are C, R0 and R1."""

LACKS_KEYS = phrase(
    "The mesh lacks the shape keys {first}, {second} and {third}: all vertices are blended linearly",
    first=KEYS[0],
    second=KEYS[1],
    third=KEYS[2],
)

ELSEWHERE = "mmd_sdef_skinning"
"""The shape key with which mmd_tools itself deforms the vertices that it excludes from the Armature modifier
by a mask."""


def vertex_data(
    points: np.ndarray, keys: np.ndarray, influences: Influences, group_of_bone: np.ndarray
) -> np.ndarray:
    """float32 [vertices, 10], as sinew.Binding takes it: C, R0, R1, then 1, or 0 where they are not used.

    As in mmd_tools, a vertex uses them where C differs from it and two bones move it, and R0 belongs to the
    bone whose vertex group comes first. The library takes R0 as that of the first influence.

    points         float32 [vertices, 3] of the basis, object space
    keys           float32 [3, vertices, 3], the same space
    influences     of bones, whose weights are positive
    group_of_bone  int [bones], the index of the group of each bone that has one
    """
    used = (influences.counts == 2) & (keys[0] != points).any(axis=1)
    first = influences.offsets[:-1][used]
    groups = group_of_bone[influences.bones]
    swapped = np.zeros(len(points), dtype=bool)
    swapped[used] = groups[first] > groups[first + 1]
    ends = np.where(swapped[:, None], keys[[2, 1]], keys[[1, 2]])
    return np.hstack([keys[0], ends[0], ends[1], used[:, None].astype(np.float32)]).astype(np.float32)


def group_of_bone(bone_names: tuple[str, ...], group_names: list[str]) -> np.ndarray:
    """int [bones]: the index of the vertex group with each bone's name, -1 for none."""
    index = {name: group for group, name in enumerate(group_names)}
    return np.array([index.get(name, -1) for name in bone_names], dtype=np.int64)
