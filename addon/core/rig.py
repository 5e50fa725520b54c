# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh is bound to: bones, influences, and what an artist should know of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .influences import Influences

NAMES_SHOWN = 5


@dataclass(frozen=True)
class Bones:
    """The bones of an armature at rest.

    names    all bones, in Blender's order
    deform   bool [bones], those that may move vertices
    rest     float32 [bones, 4, 4], armature space, Y along the bone
    """

    names: tuple[str, ...]
    deform: np.ndarray
    rest: np.ndarray

    def equals(self, other: Bones) -> bool:
        return (
            self.names == other.names
            and np.array_equal(self.deform, other.deform)
            and np.array_equal(self.rest, other.rest)
        )

    def of_groups(self, group_names: list[str]) -> np.ndarray:
        """int32 [groups]: the deforming bone of each group's name, -1 for none."""
        index = {name: bone for bone, name in enumerate(self.names) if self.deform[bone]}
        return np.array([index.get(name, -1) for name in group_names], dtype=np.int32).reshape(-1)


@dataclass(frozen=True)
class RigFacts:
    """What `sinew info` and the panel say of a bound mesh."""

    vertices: int
    bones: int
    weighted_bones: int
    mean_influences: float
    most_influences: int
    warnings: tuple[str, ...]


def describe_rig(influences: Influences, bones: Bones, group_names: list[str]) -> RigFacts:
    """Counts and warnings. `weighted_bones` counts those that move at least one vertex."""
    counts = influences.counts
    warnings = []
    bare = int((counts == 0).sum())
    if bare:
        warnings.append(f"{bare} of {len(counts)} vertices have no weights and stay at rest")
    boneless = [name for name in group_names if name not in bones.names]
    if boneless:
        warnings.append(f"Groups without a bone: {_shortened(boneless)}")
    return RigFacts(
        vertices=len(counts),
        bones=len(bones.names),
        weighted_bones=len(np.unique(influences.bones)),
        mean_influences=float(counts.mean()) if len(counts) else 0.0,
        most_influences=int(counts.max(initial=0)),
        warnings=tuple(warnings),
    )


def _shortened(names: list[str]) -> str:
    rest = len(names) - NAMES_SHOWN
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {rest} more" if rest > 0 else "")
