# SPDX-License-Identifier: GPL-3.0-or-later
"""Hooks behind Sinew's modifier that have a list of vertices."""

from __future__ import annotations

import bpy

from ..core.phrases import phrase
from . import stack


def warnings(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence for each downstream Hook with a list of vertices. Behind Geometry Nodes, and all
    other modifiers that do more than deform, Blender uses the first vertices, as many as are in the list,
    instead (seen on 4.2 to 5.2)."""
    return [
        phrase(
            "{name}: behind Sinew's modifier, Blender moves other vertices than those assigned to this Hook; "
            "give it a vertex group",
            name=hook.name,
        )
        for hook in stack.downstream(obj)
        if hook.type == "HOOK" and stack.is_on(hook)
        if len(hook.vertex_indices) and not hook.vertex_group
    ]
