# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the deformed points of a driven object are held, for Sinew's modifier to read: in an attribute of its
mesh, which is faster, or in a carrier."""

from __future__ import annotations

import bpy
import numpy as np

from . import carrier, front, mesh_io, node_group, pose_driver, properties, stack
from .heat import heat_nodes

ATTRIBUTE = "sinew_points"
# Beside them, while a heat map is shown: the colour of each vertex.
COLOURS = "sinew_colours"


def arrange(obj: bpy.types.Object) -> None:
    """Makes what holds the points of a driven object as it is now, and tells Sinew's modifier of it.

    Raises SinewError where what stands in front can not be evaluated apart.
    """
    settings, nodes = properties.of(obj), stack.sinew_modifier(obj)
    made = front.ensure(obj)
    # Points in an attribute of the mesh would make Blender evaluate again all that share it, and a comparison
    # is to leave nothing in it.
    if made is not None or not obj.data.is_editable or properties.is_copy(obj):
        if settings.attribute:
            remove_attributes(obj)
            settings.attribute = ""
            # It is on an input that a carrier's modifier does not have.
            pose_driver.remove(obj)
        kind = node_group.CARRIER
        inputs = {"Points": carrier.ensure(obj), "Front": made}
    else:
        carrier.remove(obj)
        if not settings.attribute:
            settings.attribute = _free_attribute_name(obj)
        kind = node_group.ATTRIBUTE
        inputs = {"Points": settings.attribute}
    if settings.heat:
        group = heat_nodes.get_or_make(kind)
        inputs["Colours"] = _colours_name(settings)
    else:
        group = node_group.get_or_make(kind)
    if nodes.node_group != group:
        nodes.node_group = group
    node_group.set_inputs(nodes, inputs)


def write(obj: bpy.types.Object, points: np.ndarray) -> None:
    """Stores float32 [vertices, 3], object space."""
    settings = properties.of(obj)
    if settings.carrier is not None:
        carrier.write(settings.carrier, points)
    else:
        mesh_io.write_points(obj.data, settings.attribute, points)


def keep_shown(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Stores in the mesh itself the points that were given to the evaluated one."""
    name = properties.of(obj).attribute
    shown = obj.data.evaluated_get(depsgraph).attributes.get(name) if name else None
    if shown is not None and len(shown.data) == len(obj.data.vertices):
        points = np.empty((len(shown.data), 3), dtype=np.float32)
        shown.data.foreach_get("vector", points.ravel())
        mesh_io.store_points(obj.data, name, points)


def write_colours(obj: bpy.types.Object, colours: np.ndarray) -> None:
    """Stores float32 [vertices, 3], linear."""
    settings = properties.of(obj)
    mesh_io.write_points(_holding_mesh(obj), _colours_name(settings), colours)


def has_colours(obj: bpy.types.Object) -> bool:
    return _colours_name(properties.of(obj)) in _holding_mesh(obj).attributes


def remove_colours(obj: bpy.types.Object) -> None:
    mesh_io.remove_points(_holding_mesh(obj), _colours_name(properties.of(obj)))


def _holding_mesh(obj: bpy.types.Object) -> bpy.types.Mesh:
    carrier = properties.of(obj).carrier
    return obj.data if carrier is None else carrier.data


def _colours_name(settings: properties.SinewSettings) -> str:
    return settings.attribute.replace(ATTRIBUTE, COLOURS) or COLOURS


def are_written(obj: bpy.types.Object, count: int) -> bool:
    """Whether points of as many vertices are held."""
    settings = properties.of(obj)
    if settings.carrier is not None:
        return len(settings.carrier.data.vertices) == count
    attribute = obj.data.attributes.get(settings.attribute)
    return attribute is not None and len(attribute.data) == count


def put_away(obj: bpy.types.Object) -> None:
    """Takes them off the mesh while Sinew rests: a subdivision would work them out for each of its vertices,
    and exports would have them."""
    if not obj.data.is_editmode:
        remove_attributes(obj)


def remove(obj: bpy.types.Object) -> None:
    """Takes away all that held points."""
    front.remove(obj)
    carrier.remove(obj)
    remove_attributes(obj)


def separate(objects: list[bpy.types.Object]) -> None:
    """Gives each driven object points of its own where two share them, as copies of an object do."""
    taken: set[tuple[str, str]] = set()
    for obj in objects:
        settings = properties.of(obj)
        held = {
            ("carrier", settings.carrier.name_full)
            if settings.carrier
            else (obj.data.name_full, settings.attribute)
        }
        if settings.front is not None:
            held.add(("front", settings.front.name_full))
        if held & taken and obj.is_editable:
            settings.carrier = settings.front = None
            settings.attribute = settings.front_signature = ""
            arrange(obj)
        taken |= held


def _free_attribute_name(obj: bpy.types.Object) -> str:
    used = _attributes_of_others(obj) | {attribute.name for attribute in obj.data.attributes}
    name, number = ATTRIBUTE, 0
    while name in used:
        number += 1
        name = f"{ATTRIBUTE}.{number:03d}"
    return name


def _attributes_of_others(obj: bpy.types.Object) -> set[str]:
    """The attributes that the mesh's other driven users hold their points and colours in."""
    others = [
        properties.of(other)
        for other in bpy.data.objects
        if other != obj and properties.is_driven(other) and other.data == obj.data
    ]
    return {name for settings in others for name in (settings.attribute, _colours_name(settings))}


def remove_attributes(obj: bpy.types.Object) -> None:
    """Takes all attributes of ours off the mesh but those of its other users: a mesh that was copied with
    its object's settings can have more than one."""
    if not obj.data.is_editable:
        return
    used = _attributes_of_others(obj)
    for name in [attribute.name for attribute in obj.data.attributes]:
        if name.startswith((ATTRIBUTE, COLOURS)) and name not in used:
            mesh_io.remove_points(obj.data, name)
