# SPDX-License-Identifier: GPL-3.0-or-later
"""Facts and warnings about a mesh that an armature deforms, for the artist."""

import bpy
import numpy as np

from ..attach import attach, group_uses, layout, other_tools, properties, stack, stage_settings
from ..attach.layout import Layout
from ..attach.modifier_options import ModifierOptions
from ..base.errors import SinewError
from ..base.phrases import phrase
from ..io import armature_io, mesh_io, spaces
from ..skinning import sdef
from ..skinning.rig import RigFacts, Weighting, describe_rig
from ..skinning.vectors import transformed
from .skinned_object import SkinnedObject


def facts_of(obj: bpy.types.Object, skinned: SkinnedObject) -> RigFacts:
    """Returns facts and warnings about a mesh that was read. They are found when somebody asks, so that no
    edit waits for them, and kept until it is bound anew."""
    if skinned.facts is None:
        armature, deformer = properties.of(obj).armature, skinned.bound.first_deformer
        points, depsgraph = skinned.bound.source.points, bpy.context.view_layer.depsgraph
        skinned.facts = _describe(obj, layout.read(obj), armature, deformer.weighting, points, depsgraph)
    return skinned.facts


def _describe(
    obj: bpy.types.Object,
    now: Layout,
    armature: bpy.types.Object | None,
    weighting: Weighting,
    points: np.ndarray,
    depsgraph: bpy.types.Depsgraph,
) -> RigFacts:
    """Returns counts, and warnings about what is missing in the rig or not reproduced.

    now       its layout
    armature  of its first Armature modifier; None where it was deleted, and others deform the mesh
    points    [vertices, 3], rest points in object space
    """
    space = None
    if armature is not None:
        space = spaces.bones_from_model_in(depsgraph, obj, armature)
    if space is not None and weighting.depends_on_points:
        points = transformed(points, space)
    boneless = weighting.bones.groups_without_bone([group.name for group in obj.vertex_groups])
    masks = group_uses.used(obj, boneless)
    facts = describe_rig(weighting, points, [name for name in boneless if name not in masks])
    found = [*_apart(now), *_missing_groups(obj), *_other_sdef(obj), *other_tools.warnings(obj, now)]
    return facts.with_warnings(found)


def _apart(now: Layout) -> list[str]:
    """Returns a sentence where Armature modifiers do not directly follow the first."""
    others = (m for m in now.modifiers if m not in now.skins)
    names = [m.name for m in others if m.armature is not None and m.armature.uid]
    text = (
        "Armature modifiers apart from the first stay Blender's: {names}; move them right behind it to have "
        "Sinew deform by them"
    )
    return [phrase(text, names=", ".join(names))] if names else []


def _other_sdef(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence where mmd_tools' own SDEF deforms the mesh, too."""
    keys = obj.data.shape_keys
    block = None if keys is None else keys.key_blocks.get(sdef.ELSEWHERE)
    if block is None or block.mute:
        return []
    return [
        phrase(
            "mmd_tools deforms a part of this mesh by its shape key {name}: unbind its SDEF, then Sinew "
            "deforms all of it",
            name=sdef.ELSEWHERE,
        )
    ]


def _missing_groups(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence for each active stage whose vertex group does not exist."""
    if not properties.has_sinew(obj):
        return []
    settings = properties.of(obj)
    groups, found = stage_settings.vertex_groups(settings), []
    for stage in stage_settings.names_on(settings):
        name = groups.get(stage, "")
        missing = phrase("no vertex group {name}", name=name) if name else phrase("no vertex group is chosen")
        if stage == "mix" and name not in obj.vertex_groups:
            found.append(phrase("{missing} for the mix: nothing is mixed", missing=missing))
        elif name and name not in obj.vertex_groups:
            label = phrase(stage_settings.STAGES[stage].label)
            text = "{missing} for {stage}: it acts everywhere"
            found.append(phrase(text, missing=missing, stage=label))
    return found


def describe_in_file(obj: bpy.types.Object) -> RigFacts:
    """The same for a mesh object as stored in the file, with the reason why Sinew cannot deform it, if there
    is one."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    armature = attach.armature_of(obj)
    bones = armature_io.read_bones(armature.evaluated_get(depsgraph))
    weights = mesh_io.read_group_weights(obj.data)
    options = ModifierOptions.read(stack.armature_modifier(obj))
    weighting = options.weighting(obj.vertex_groups.keys(), weights, bones)
    points = mesh_io.read_points(obj.data)
    now = layout.read(obj)
    return _describe(obj, now, armature, weighting, points, depsgraph).with_warnings(_obstacles(obj))


def _obstacles(obj: bpy.types.Object) -> list[str]:
    """Why Sinew cannot deform the mesh: empty, or one sentence."""
    if properties.has_sinew(obj):
        return []
    try:
        attach.check_can_add(obj)
    except SinewError as error:
        return [str(error)]
    return []
