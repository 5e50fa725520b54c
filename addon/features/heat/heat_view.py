# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes show a heat map. Its colour attribute is active in them, 3D views in Solid shading take
colours from attributes, and both are restored when nothing is shown any more.

Meshes and screens have properties that keep what was there before, so saved files have it, too. Undo changes
meshes, but no screens: sync() follows it.
"""

import json
from collections.abc import Collection, Iterator

import bpy

from ...attach import node_group, properties
from . import bake_error, heat_nodes, measures


def shown() -> set[bpy.types.Mesh]:
    """The meshes that show colours now."""
    found = {obj.data for scene in bpy.data.scenes for obj in bake_error.shown(scene)}
    for obj in filter(properties.has_sinew, bpy.data.objects):
        if properties.of(obj).heat and properties.of(obj).enabled:
            found.add(obj.data)
    return found


def sync() -> None:
    """Updates meshes and views; called where what is shown may have changed."""
    activate(shown())


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


FROM_ATTRIBUTE = "VERTEX"


def activate(shown: Collection[bpy.types.Mesh]) -> None:
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
        mesh.attributes.active_color_name = heat_nodes.NAME
    elif is_kept and not is_shown:
        # What the artist chose meanwhile stays.
        if mesh.attributes.active_color_name == heat_nodes.NAME:
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
