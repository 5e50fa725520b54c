# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be said of a mesh without driving it."""

from __future__ import annotations

import bpy

from ..core.errors import SinewError
from ..core.influences import build_influences
from ..core.rig import RigFacts, describe_rig
from . import armature_io, drive, mesh_io, modifier_options, properties


def describe(obj: bpy.types.Object) -> RigFacts:
    """Facts of a mesh object that an armature deforms, with all that a user should be warned of."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    armature, modifier = drive.armature_of(obj), drive.armature_modifier(obj)
    bones = armature_io.read_bones(armature.evaluated_get(depsgraph))
    names = [group.name for group in obj.vertex_groups]
    options = modifier_options.ModifierOptions.read(modifier)
    weights = options.groups(mesh_io.read_group_weights(obj.data))
    facts = describe_rig(build_influences(weights, bones.of_groups(names)), bones, names)
    more = modifier_options.differences(obj, modifier, armature, facts.bare_vertices)
    return facts.with_warnings([*more, *_obstacles(obj)])


def _obstacles(obj: bpy.types.Object) -> list[str]:
    """What keeps Sinew from driving the mesh: nothing, or one sentence."""
    if properties.is_driven(obj):
        return []
    try:
        drive.check_can_add(obj)
    except SinewError as error:
        return [str(error)]
    return []
