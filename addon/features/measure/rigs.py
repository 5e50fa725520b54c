# SPDX-License-Identifier: GPL-3.0-or-later
"""The armatures of a moment, with the bones that move vertices, and the moment in other poses of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import bpy
import numpy as np

from ...attach import attach
from ...io import armature_io
from ...skinning.rig import Bones
from . import battery
from .character import Skeleton
from .live import Moment


@dataclass
class Rig:
    """
    bones   of the armature, which know the skin of all meshes
    world   float64 [4, 4], of the armature
    moving  names of the bones that move vertices
    first   the number of its first bone in skeleton_of()
    """

    armature: bpy.types.Object
    bones: Bones
    world: np.ndarray
    moving: set[str] = field(default_factory=set)
    first: int = 0

    @property
    def is_moving(self) -> np.ndarray:
        """bool [bones]"""
        return np.array([name in self.moving for name in self.bones.names], bool)

    @cached_property
    def battery(self) -> battery.Battery:
        """Within the limits that its bones have."""
        return battery.Battery(self.bones, armature_io.read_limits(self.armature), self.is_moving)


def skeleton_of(rigs: Sequence[Rig]) -> Skeleton:
    """Returns the bones of all, in this order."""
    names: list[str] = []
    roles: list[str] = []
    parts = []
    for number, rig in enumerate(rigs):
        bones = rig.bones
        rest = rig.world @ bones.rest[: len(bones.names)].astype(np.float64)
        names += bones.names
        roles += rig.battery.roles()
        side, mirror = battery.sides(bones.names)
        parts.append(
            (
                rest,
                bones.limb_ends(rest),
                np.where(bones.deforming_parents >= 0, bones.deforming_parents + rig.first, -1),
                bones.deform,
                side,
                np.where(mirror >= 0, mirror + rig.first, -1),
                np.full(len(side), number),
            )
        )
    rest, tails, above, deform, side, mirror, rig_of = map(np.concatenate, zip(*parts, strict=True))
    rig_names = tuple(rig.armature.name for rig in rigs)
    return Skeleton(tuple(names), rest, tails, above, deform, tuple(roles), side, mirror, rig_of, rig_names)


def rig_in(found: dict[int, Rig], armature: bpy.types.Object, bones: Bones, world: np.ndarray) -> Rig:
    """Returns the armature's rig of `found`, made there if need be, with the skin of these bones too."""
    rig = found.get(armature.session_uid)
    if rig is None:
        first = sum(len(each.bones.names) for each in found.values())
        rig = found[armature.session_uid] = Rig(armature, bones, world, first=first)
    else:
        rig.bones = rig.bones.with_skin_of(bones)
    return rig


def rigs_of(now: Moment) -> list[Rig]:
    found: dict[int, Rig] = {}
    for part in now.subject.parts:
        pairs = attach.replaced_modifiers(part.obj)
        for skin, (_modifier, replaced) in zip(part.skin_stack.skins, pairs, strict=False):
            if replaced.armature is None:
                continue
            world = np.array(replaced.armature.matrix_world)
            rig = rig_in(found, replaced.armature, skin.deformer.bones, world)
            rig.moving.update(skin.deformer.moving_bones)
    return list(found.values())


def posed(now: Moment, poses: Mapping[tuple[str, ...], battery.Pose]) -> Moment:
    """poses: by the names of a rig's bones; other rigs are at rest"""
    return now.posed(
        lambda bones: battery.posed(bones, poses[bones.names]) if bones.names in poses else bones.rest
    )
