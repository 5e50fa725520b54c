# SPDX-License-Identifier: GPL-3.0-or-later
"""The Geometry Nodes group "Sinew": moves each vertex to the point that an attribute holds for it."""

from __future__ import annotations

import bpy

# A custom property on the group, so that a renamed or copied group is still known as ours.
MARK = "sinew_node_group"


def get_or_make() -> bpy.types.NodeTree:
    for group in bpy.data.node_groups:
        if group.get(MARK) and group.library is None:
            return group
    return _make()


def is_sinew(modifier: bpy.types.Modifier) -> bool:
    return (
        modifier.type == "NODES" and modifier.node_group is not None and bool(modifier.node_group.get(MARK))
    )


def remove_unused() -> None:
    for group in [g for g in bpy.data.node_groups if g.get(MARK) and g.library is None and g.users == 0]:
        bpy.data.node_groups.remove(group)


def set_attribute_name(modifier: bpy.types.Modifier, name: str) -> None:
    """Tells a Sinew modifier which attribute holds its points."""
    socket = _points_socket(modifier.node_group)
    if hasattr(modifier, "properties"):  # Blender 5.2 moved the inputs
        getattr(modifier.properties.inputs, socket).value = name
    else:
        modifier[socket] = name


def _points_socket(group: bpy.types.NodeTree) -> str:
    for item in group.interface.items_tree:
        if item.item_type == "SOCKET" and item.in_out == "INPUT" and item.socket_type == "NodeSocketString":
            return item.identifier
    raise RuntimeError(f"node group {group.name!r} has lost its attribute input")


def _make() -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new("Sinew", "GeometryNodeTree")
    group[MARK] = 1
    group.is_modifier = True
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    points = group.interface.new_socket("Points", in_out="INPUT", socket_type="NodeSocketString")
    points.description = "Attribute that holds the deformed position of each vertex"
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")

    source = group.nodes.new("NodeGroupInput")
    named = group.nodes.new("GeometryNodeInputNamedAttribute")
    named.data_type = "FLOAT_VECTOR"
    place = group.nodes.new("GeometryNodeSetPosition")
    result = group.nodes.new("NodeGroupOutput")
    for column, node in enumerate((source, named, place, result)):
        node.location = (220 * column, 0)
    group.links.new(source.outputs["Points"], named.inputs["Name"])
    group.links.new(source.outputs["Geometry"], place.inputs["Geometry"])
    group.links.new(named.outputs["Attribute"], place.inputs["Position"])
    # A mesh without the attribute keeps its shape instead of falling into the origin.
    group.links.new(named.outputs["Exists"], place.inputs["Selection"])
    group.links.new(place.outputs["Geometry"], result.inputs["Geometry"])
    return group
