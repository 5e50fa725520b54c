# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes what has to be set for a heat map to be visible, and restores it afterwards: the active colour
attribute of meshes, and the colour source of 3D views in Solid shading."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

import bpy

from ...attach import node_group, properties
from . import heat_legend, heat_nodes, measures

FROM_ATTRIBUTE = "VERTEX"


def sync(objects: Iterable[bpy.types.Object]) -> None:
    """Updates the file and the views for the objects that show a heat map."""
    shown = [obj for obj in objects if properties.of(obj).heat and properties.of(obj).enabled]
    _choose_attributes({obj.data for obj in shown if obj.data.is_editable})
    _choose_colours(bool(shown))
    heat_legend.show(bool(shown))


def take_off(obj: bpy.types.Object) -> None:
    """Removes the heat map from an object, except its node group."""
    properties.of(obj).property_unset("heat")
    # First, as Blender 4.2 activates another colour attribute when any attribute is removed.
    sync(_objects())
    heat_nodes.remove_colours(obj)
    heat_nodes.remove_applied(obj.data)


def tidy() -> None:
    """Removes what no object needs any more."""
    objects = _objects()
    node_group.remove_unused()
    heat_nodes.remove_unused_material()
    if not objects:
        for scene in bpy.data.scenes:
            if scene.is_editable:
                measures.clear(scene)


def _objects() -> list[bpy.types.Object]:
    return [obj for obj in bpy.data.objects if properties.has_sinew(obj)]


def _choose_attributes(meshes: set[bpy.types.Mesh]) -> None:
    """Makes the heat map the active colour attribute of these meshes, and of no others."""
    for mesh in bpy.data.meshes:
        kept = mesh.is_property_set("sinew_active_colour")
        if mesh in meshes and not kept:
            mesh.sinew_active_colour = mesh.attributes.active_color_name
            # The attribute exists only in the evaluated mesh, so setting the name is enough.
            mesh.attributes.active_color_name = heat_nodes.NAME
        elif kept and mesh not in meshes and mesh.is_editable:
            if mesh.attributes.active_color_name == heat_nodes.NAME:
                mesh.attributes.active_color_name = mesh.sinew_active_colour
            mesh.property_unset("sinew_active_colour")
            mesh.update_tag()


def _choose_colours(heat: bool) -> None:
    """Makes the 3D views take colours from attributes, or restores their earlier source."""
    for screen in bpy.data.screens:
        kept = screen.is_property_set("sinew_colour_types")
        if heat and not kept:
            screen.sinew_colour_types = json.dumps([shading.color_type for shading in _shadings(screen)])
            for shading in _shadings(screen):
                shading.color_type = FROM_ATTRIBUTE
        elif kept and not heat:
            before = json.loads(screen.sinew_colour_types)
            for number, shading in enumerate(_shadings(screen)):
                # What the artist chose meanwhile stays; a view that was made meanwhile gets the default.
                if shading.color_type == FROM_ATTRIBUTE:
                    shading.color_type = before[number] if number < len(before) else "MATERIAL"
            screen.property_unset("sinew_colour_types")


def _shadings(screen: bpy.types.Screen) -> Iterator[bpy.types.View3DShading]:
    for area in screen.areas:
        for space in area.spaces:
            if space.type == "VIEW_3D":
                yield space.shading
