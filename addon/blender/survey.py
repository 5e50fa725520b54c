# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be said of a mesh without driving it."""

from __future__ import annotations

import bpy

from ..core.errors import SinewError
from ..core.influences import build_influences
from ..core.rig import RigFacts, describe_rig
from . import armature_io, drive, mesh_io, properties


def describe(obj: bpy.types.Object) -> RigFacts:
    """Facts of a mesh object that an armature deforms."""
    bones = armature_io.read_bones(drive.armature_of(obj))
    names = [group.name for group in obj.vertex_groups]
    influences = build_influences(mesh_io.read_group_weights(obj.data), bones.of_groups(names))
    return describe_rig(influences, bones, names)


def obstacles(obj: bpy.types.Object) -> list[str]:
    """What keeps Sinew from driving the mesh: nothing, or one sentence."""
    if properties.is_driven(obj):
        return []
    try:
        drive.check_can_add(obj)
    except SinewError as error:
        return [str(error)]
    return []
