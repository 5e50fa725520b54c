# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the heat map's colour attribute active in the meshes that show it, has 3D views in Solid shading take
colours from attributes, and restores both when nothing is shown any more.

Meshes and screens have properties that keep what was there before, so saved files have it, too. Undo changes
meshes, but no screens: sync() follows it.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator

import bpy

from .heat_nodes import NAME

FROM_ATTRIBUTE = "VERTEX"


def sync(shown: Collection[bpy.types.Mesh]) -> None:
    """shown: the meshes that show the attribute."""
    for mesh in bpy.data.meshes:
        if mesh.is_editable:
            _choose_attribute(mesh, mesh in shown)
    for screen in bpy.data.screens:
        _choose_colours(screen, bool(shown))


def _choose_attribute(mesh: bpy.types.Mesh, is_shown: bool) -> None:
    """Makes it active, or what was active before. It may be an attribute of the evaluated mesh only: its name
    is enough."""
    is_kept = mesh.is_property_set("sinew_shown_colours")
    if is_shown and not is_kept:
        mesh.sinew_shown_colours = mesh.attributes.active_color_name
        mesh.attributes.active_color_name = NAME
    elif is_kept and not is_shown:
        # What the artist chose meanwhile stays.
        if mesh.attributes.active_color_name == NAME:
            mesh.attributes.active_color_name = mesh.sinew_shown_colours
        mesh.property_unset("sinew_shown_colours")
        mesh.update_tag()


def _choose_colours(screen: bpy.types.Screen, are_shown: bool) -> None:
    """Makes the 3D views take colours from attributes, or restores their earlier source."""
    is_kept = screen.is_property_set("sinew_colour_types")
    if are_shown and not is_kept:
        screen.sinew_colour_types = json.dumps([shading.color_type for shading in _shadings(screen)])
        for shading in _shadings(screen):
            shading.color_type = FROM_ATTRIBUTE
    elif is_kept and not are_shown:
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
