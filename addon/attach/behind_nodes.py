# SPDX-License-Identifier: GPL-3.0-or-later
"""Modifiers that act otherwise behind Sinew's, as behind Geometry Nodes and all other modifiers that do more
than deform (seen on 4.2 to 5.2)."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..core.phrases import phrase
from . import stack


def warnings(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence for each downstream modifier that acts otherwise with Sinew than without."""
    return [phrase(text, name=modifier.name) for modifier in _changed(obj) if (text := _warning(modifier))]


def _changed(obj: bpy.types.Object) -> Iterator[bpy.types.Modifier]:
    """Yields the downstream modifiers in front of which Sinew's is the first that does more than deform."""
    if any(
        modifier.type not in stack.ONLY_DEFORM for modifier in stack.upstream(obj) if stack.is_on(modifier)
    ):
        return
    for modifier in filter(stack.is_on, stack.downstream(obj)):
        if modifier.type not in stack.ONLY_DEFORM:
            return
        yield modifier


def _warning(modifier: bpy.types.Modifier) -> str:
    # Blender uses the first vertices, as many as are in the list.
    if modifier.type == "HOOK" and len(modifier.vertex_indices) and not modifier.vertex_group:
        return (
            "{name}: behind Sinew's modifier, Blender moves other vertices than those assigned to this Hook; "
            "give it a vertex group"
        )
    if modifier.type == "PARTICLE_SYSTEM" and modifier.particle_system.settings.emit_from != "VERT":
        return (
            "{name}: behind Sinew's modifier, Blender puts these particles and hairs elsewhere on the mesh; "
            "emit them from vertices, from another mesh, or leave this mesh to its Armature modifier"
        )
    if modifier.type == "CLOTH" and modifier.settings.rest_shape_key is not None:
        return (
            "{name}: behind Sinew's modifier, Blender does not use the Rest Shape Key of this Cloth as it "
            "should; leave this mesh to its Armature modifier"
        )
    return ""
