# SPDX-License-Identifier: GPL-3.0-or-later
"""Hooks that stand behind Sinew's modifier and are given vertices."""

from __future__ import annotations

import bpy

from . import stack


def misled(obj: bpy.types.Object) -> list[str]:
    """A sentence for each Hook that moves other vertices than it was given: behind a modifier that can change
    the mesh, which Sinew's is, Blender (4.2 to 5.2) takes as many vertices from the first on."""
    nodes = stack.sinew_modifier(obj)
    if nodes is None:
        return []
    modifiers = list(obj.modifiers)
    return [
        f"{hook.name}: behind Sinew's modifier Blender hooks other vertices than those assigned; give it a "
        "vertex group"
        for hook in modifiers[modifiers.index(nodes) + 1 :]
        if hook.type == "HOOK" and stack.is_on(hook) and not hook.vertex_group and len(hook.vertex_indices)
    ]
