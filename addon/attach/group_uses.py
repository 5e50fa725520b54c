# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds vertex groups with another use than the weights of a bone: a group without a bone is no fault if it
is a mask."""

from collections.abc import Collection, Iterator
from functools import partial

import bpy

from . import layout, properties, stage_settings


def used(obj: bpy.types.Object, names: Collection[str], but: str = "") -> set[str]:
    """Returns those of the object's groups `names` that something uses: a modifier (also as the Armature
    modifier's mask), a shape key, one of Sinew's stages, a constraint, or a bone of another of the object's
    armatures.

    but  the name of a stage that does not count
    """
    unused = set(names)
    in_stages = partial(_in_stages, but=but)
    for uses in (_in_modifiers, _in_shape_keys, in_stages, _bones_of_all_armatures, _in_constraints):
        unused -= set(uses(obj)) if unused else set()
    return set(names) - unused


def _in_modifiers(obj: bpy.types.Object) -> Iterator[str]:
    neutral = layout.read(obj).neutral
    for modifier in obj.modifiers:
        # Any group does for it.
        if modifier.name == neutral:
            continue
        yield from _texts(modifier)
        if modifier.type == "NODES" and not hasattr(modifier, "properties"):  # before Blender 5.2
            yield from (value for _key, value in modifier.items() if isinstance(value, str))
        elif modifier.type == "PARTICLE_SYSTEM":
            yield from _texts(modifier.particle_system, depth=0)
        elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings is not None:
            for surface in modifier.canvas_settings.canvas_surfaces:
                yield from (surface.output_name_a, surface.output_name_b)


def _texts(of: bpy.types.bpy_struct, depth: int = 3) -> Iterator[str]:
    """Yields the strings that are set in a modifier and its parts: each kind of modifier has other properties
    for groups, and Geometry Nodes have them among their inputs."""
    for name, prop in of.bl_rna.properties.items():
        if prop.type == "STRING" and name != "name":
            yield getattr(of, name)
        elif prop.type == "POINTER" and depth and name != "rna_type":
            inner = getattr(of, name)
            # Not other data-blocks: these have groups of their own.
            if inner is not None and not isinstance(inner, bpy.types.ID):
                yield from _texts(inner, depth - 1)


def _in_shape_keys(obj: bpy.types.Object) -> Iterator[str]:
    keys = obj.data.shape_keys
    yield from (key.vertex_group for key in keys.key_blocks) if keys is not None else ()


def _in_stages(obj: bpy.types.Object, but: str) -> Iterator[str]:
    if properties.has_sinew(obj):
        groups = stage_settings.vertex_groups(properties.of(obj))
        yield from (group for stage, group in groups.items() if stage != but)


def _bones_of_all_armatures(obj: bpy.types.Object) -> Iterator[str]:
    armatures = {modifier.object for modifier in obj.modifiers if modifier.type == "ARMATURE"}
    for armature in armatures - {None}:
        yield from (bone.name for bone in armature.data.bones)


def _in_constraints(obj: bpy.types.Object) -> Iterator[str]:
    for other in bpy.data.objects:
        owners = [other, *(other.pose.bones if other.pose is not None else ())]
        for owner in owners:
            for constraint in owner.constraints:
                if getattr(constraint, "target", None) == obj:
                    yield getattr(constraint, "subtarget", "")
