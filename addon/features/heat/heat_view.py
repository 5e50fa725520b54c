# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes show a heat map, and what has to be done where one begins or ends."""

from __future__ import annotations

import bpy

from ...attach import node_group, properties
from . import bake_error, heat_legend, heat_nodes, measures, shown_colours


def shown() -> set[bpy.types.Mesh]:
    """The meshes that show colours now."""
    found = {obj.data for scene in bpy.data.scenes for obj in bake_error.shown(scene)}
    for obj in filter(properties.has_sinew, bpy.data.objects):
        if properties.of(obj).heat and properties.of(obj).enabled:
            found.add(obj.data)
    return found


def sync() -> None:
    """Updates meshes, views and the legend; called where what is shown may have changed."""
    meshes = shown()
    shown_colours.sync(meshes)
    heat_legend.show(bool(meshes))


def sync_errors() -> None:
    """Colours the meshes that show errors of a bake, and no others."""
    for scene in bpy.data.scenes:
        if bake_error.shown(scene):
            bake_error.colour(scene)
    sync()
    meshes = shown()
    for obj in filter(bake_error.is_on, bpy.data.objects):
        if obj.type == "MESH" and obj.data not in meshes:
            heat_nodes.remove_applied(obj.data)


def take_off(obj: bpy.types.Object) -> None:
    """Removes the heat map from an object, except its node group."""
    properties.of(obj).property_unset("heat")
    # First, as Blender chooses another active colour attribute when that one is removed.
    sync()
    heat_nodes.remove_colours(obj)
    heat_nodes.remove_applied(obj.data)


def tidy() -> None:
    """Removes what no object needs any more."""
    node_group.remove_unused()
    heat_nodes.remove_unused_material()
    if not any(map(properties.has_sinew, bpy.data.objects)):
        for scene in bpy.data.scenes:
            if scene.is_editable:
                measures.clear(scene)
