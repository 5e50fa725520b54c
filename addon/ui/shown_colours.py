# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour attributes that features show, such as heat maps: makes them active in their meshes, has 3D views in
Solid shading take colours from attributes, and restores both when nothing is shown any more.

Meshes and screens have properties that keep what was there before, so saved files have it, too. Undo changes
meshes, but no screens: sync() follows it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator

import bpy

from ..attach.subscribers import subscribers

FROM_ATTRIBUTE = "VERTEX"
# For each feature: returns the meshes that it shows in colours now, each with the attribute's name.
sources: list[Callable[[], Iterable[tuple[bpy.types.Mesh, str]]]] = []


def sync() -> None:
    """Updates meshes and views; called where what is shown may have changed."""
    wanted: dict[bpy.types.Mesh, list[str]] = {}
    for source in sources:
        for mesh, name in source():
            wanted.setdefault(mesh, []).append(name)
    for mesh in bpy.data.meshes:
        if mesh.is_editable:
            _choose_attribute(mesh, wanted.get(mesh, []))
    for screen in bpy.data.screens:
        _choose_colours(screen, bool(wanted))


def _choose_attribute(mesh: bpy.types.Mesh, wanted: list[str]) -> None:
    """Makes active what was switched on last, or what was active before. The attribute may be one of the
    evaluated mesh only: its name is enough."""
    if not wanted and not mesh.is_property_set("sinew_shown_colours"):
        return
    before, shown = json.loads(mesh.sinew_shown_colours or '["", []]')
    active = mesh.attributes.active_color_name
    is_ours = active in shown
    if not is_ours:
        # The artist's choice, perhaps made meanwhile.
        before = active
    stay = [name for name in shown if name in wanted]
    new = [name for name in dict.fromkeys(wanted) if name not in shown]
    if new or is_ours:
        _activate(mesh, [before, *stay, *new][-1])
    if stay or new:
        properties = json.dumps([before, [*stay, *new]])
        if properties != mesh.sinew_shown_colours:
            mesh.sinew_shown_colours = properties
    else:
        mesh.property_unset("sinew_shown_colours")
    if len(stay) < len(shown):
        mesh.update_tag()


def _activate(mesh: bpy.types.Mesh, name: str) -> None:
    # Setting an unchanged name makes Blender evaluate the mesh, too.
    if mesh.attributes.active_color_name != name:
        mesh.attributes.active_color_name = name


def _choose_colours(screen: bpy.types.Screen, are_shown: bool) -> None:
    """Makes the 3D views take colours from attributes, or restores their earlier source."""
    kept = screen.is_property_set("sinew_colour_types")
    if are_shown and not kept:
        screen.sinew_colour_types = json.dumps([shading.color_type for shading in _shadings(screen)])
        for shading in _shadings(screen):
            shading.color_type = FROM_ATTRIBUTE
    elif kept and not are_shown:
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


def _objects_changed(_objects: list[bpy.types.Object]) -> None:
    """Also after undo, redo and loading."""
    sync()


def register() -> None:
    # The artist's choices while colours are shown.
    bpy.types.Mesh.sinew_shown_colours = bpy.props.StringProperty(options={"HIDDEN"})
    bpy.types.Screen.sinew_colour_types = bpy.props.StringProperty(options={"HIDDEN"})
    subscribers.objects_changed.append(_objects_changed)


def unregister() -> None:
    """Called after the features: without their sources, meshes and views are restored."""
    sync()
    subscribers.objects_changed.remove(_objects_changed)
    del bpy.types.Mesh.sinew_shown_colours, bpy.types.Screen.sinew_colour_types
