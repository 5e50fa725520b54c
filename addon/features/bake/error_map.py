# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map of a bake to bones: the error of the baked mesh at each vertex, before and after the bake, as
colours that views in Solid shading show. They exist only while it is on, as exporters would write them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence

import bpy
import numpy as np

from ...core.heat import linear, viridis
from ...io import mesh_io
from ...io.helper_bones_io import ERRORS, ERRORS_BEFORE
from ...io.mesh_io import find_attribute

BEFORE, AFTER, OFF = "BEFORE", "AFTER", "OFF"
OF_CHOICE = {BEFORE: ERRORS_BEFORE, AFTER: ERRORS}
# The colour attributes of the mesh, one at a time.
COLOURS = {BEFORE: "Sinew bake error before, colours", AFTER: "Sinew bake error, colours"}
# Custom properties of the mesh and of the screen: what was shown before.
ACTIVE, COLOUR_TYPES = "sinew_bake_error_active_colour", "sinew_bake_error_colour_types"
FROM_ATTRIBUTE = "VERTEX"


def is_baked(obj: bpy.types.Object) -> bool:
    return obj.type == "MESH" and all(find_attribute(obj.data, name) for name in OF_CHOICE.values())


def shown(objects: Iterable[bpy.types.Object]) -> str:
    """Which errors the first of these shows that shows any."""
    for obj in objects:
        for choice, name in COLOURS.items():
            if find_attribute(obj.data, name) is not None:
                return choice
    return OFF


def errors(objects: Sequence[bpy.types.Object], choice: str) -> np.ndarray:
    """float32 [vertices of all], in units of the scene."""
    return np.concatenate([_errors_of(obj.data, choice) for obj in objects])


def end_of_scale(objects: Sequence[bpy.types.Object]) -> float:
    """The largest error before and after: one range, so that the two can be compared."""
    return max(float(errors(objects, choice).max(initial=0.0)) for choice in OF_CHOICE)


def show(objects: Sequence[bpy.types.Object], choice: str) -> None:
    """Shows the errors of one of OF_CHOICE, or none."""
    end = max(end_of_scale(objects), 1e-30)
    for mesh in {obj.data for obj in objects}:
        _take_off(mesh)
        if choice != OFF:
            _put_on(mesh, choice, linear(viridis(_errors_of(mesh, choice) / end)))
        mesh.update_tag()
    others = [obj for obj in bpy.data.objects if is_baked(obj)]
    _choose_colours(shown(others) != OFF)


def _errors_of(mesh: bpy.types.Mesh, choice: str) -> np.ndarray:
    found = np.zeros(len(mesh.vertices), dtype=np.float32)
    find_attribute(mesh, OF_CHOICE[choice]).data.foreach_get("value", found)
    return found


def _put_on(mesh: bpy.types.Mesh, choice: str, colours: np.ndarray) -> None:
    mesh[ACTIVE] = mesh.attributes.active_color_name
    rows = np.ones((len(colours), 4), dtype=np.float32)
    rows[:, :3] = colours
    attribute = mesh_io.add_attribute(mesh, COLOURS[choice], "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", rows.ravel())
    mesh.attributes.active_color_name = COLOURS[choice]


def _take_off(mesh: bpy.types.Mesh) -> None:
    for name in COLOURS.values():
        if find_attribute(mesh, name) is not None:
            mesh_io.remove_attribute(mesh, name)
            mesh.attributes.active_color_name = mesh.get(ACTIVE, "")
    mesh.pop(ACTIVE, None)


def _choose_colours(are_shown: bool) -> None:
    """Makes the 3D views take colours from attributes, or from what they took them before."""
    for screen in bpy.data.screens:
        if are_shown and COLOUR_TYPES not in screen:
            screen[COLOUR_TYPES] = json.dumps([shading.color_type for shading in _shadings(screen)])
            for shading in _shadings(screen):
                shading.color_type = FROM_ATTRIBUTE
        elif not are_shown and COLOUR_TYPES in screen:
            before = json.loads(screen.pop(COLOUR_TYPES))
            for shading, colour_type in zip(_shadings(screen), before, strict=False):
                if shading.color_type == FROM_ATTRIBUTE:
                    shading.color_type = colour_type


def _shadings(screen: bpy.types.Screen) -> Iterator[bpy.types.View3DShading]:
    for area in screen.areas:
        for space in area.spaces:
            if space.type == "VIEW_3D":
                yield space.shading
