# SPDX-License-Identifier: GPL-3.0-or-later
"""The Geometry Nodes groups that also colour the mesh: they contain those of node_group, while a heat map is
shown.

The colours are an attribute of the evaluated mesh only, with the same name for all objects: so objects that
share a mesh have separate colours, and one material shows them all.
"""

import bpy
import numpy as np

from ...attach import node_group, properties
from ...attach.node_group import POINT_BUFFER, add
from ...io import mesh_io

# The colour attribute of evaluated meshes.
NAME = "Sinew Heat"
# The attribute of a point buffer with each vertex's colour.
COLOURS = "sinew_colours"
MARK = "sinew_heat"
_KIND = 15


def group_of(obj: bpy.types.Object) -> bpy.types.NodeTree | None:
    """Returns the group for an object that shows a heat map; None for others."""
    return (node_group.find(_KIND) or _make()) if properties.of(obj).heat else None


def remove_unused_material() -> None:
    for material in [m for m in bpy.data.materials if m.get(MARK) and m.library is None and m.users == 0]:
        bpy.data.materials.remove(material)


def write_colours(obj: bpy.types.Object, colours: np.ndarray) -> None:
    """Stores float32 [vertices, 3], linear, in the point buffer, and has Blender evaluate it."""
    mesh = properties.of(obj).storage.point_buffer.data
    mesh_io.write_vectors(mesh, COLOURS, colours)
    mesh.update_tag()


def write_to_mesh(mesh: bpy.types.Mesh, colours: np.ndarray) -> None:
    """Stores float32 [vertices, 3], linear, in a mesh without Sinew."""
    rows = np.ones((len(colours), 4), dtype=np.float32)
    rows[:, :3] = colours
    attribute = mesh_io.attribute_to_write(mesh, NAME)
    if attribute is None:
        attribute = mesh_io.add_attribute(mesh, NAME, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", rows.ravel())
    mesh.update_tag()


def has_colours(obj: bpy.types.Object) -> bool:
    point_buffer = properties.of(obj).storage.point_buffer
    return point_buffer is not None and mesh_io.find_attribute(point_buffer.data, COLOURS) is not None


def remove_colours(obj: bpy.types.Object) -> None:
    if has_colours(obj):
        mesh_io.remove_attribute(properties.of(obj).storage.point_buffer.data, COLOURS)


def remove_applied(mesh: bpy.types.Mesh) -> None:
    """Removes colours from a mesh that has them itself, and the material if the group was applied. Faces get
    the material of the previous slot: the mesh no longer knows which one they had."""
    if not mesh.is_editable or mesh.is_editmode:
        return
    mesh_io.remove_attribute(mesh, NAME)
    for slot in reversed(range(len(mesh.materials))):
        material = mesh.materials[slot]
        if material is not None and material.get(MARK):
            mesh.materials.pop(index=slot)


def _make() -> bpy.types.NodeTree:
    """Returns a group that takes points and colours from a point buffer."""
    points = node_group.get_or_make(POINT_BUFFER)
    inputs = {
        item.name: (item.socket_type, item.description)
        for item in points.interface.items_tree
        if item.in_out == "INPUT" and item.name != "Geometry"
    }
    group = node_group.new_group(f"{points.name} Heat", _KIND, inputs)
    source = add(group, "NodeGroupInput").outputs
    given = {name: source[name] for name in ("Geometry", *inputs)}
    place = add(group, "GeometryNodeGroup", given, node_tree=points)
    buffer = add(group, "GeometryNodeObjectInfo", {"Object": source["Points"]}).outputs["Geometry"]
    # Each vertex takes the colour of the point buffer's vertex with the same index.
    index = add(group, "GeometryNodeInputIndex")
    colour = node_group.sample(group, buffer, node_group.named_attribute(group, COLOURS), index)
    # Without colours, as before the first ones are written, the material is not changed either.
    same = node_group.same_count(group, source["Geometry"], buffer)
    stored = {"Geometry": place, "Selection": same, "Name": NAME, "Value": colour}
    store = add(group, "GeometryNodeStoreNamedAttribute", stored, data_type="FLOAT_COLOR", domain="POINT")
    painted = {"Geometry": store, "Selection": same, "Material": _material()}
    add(group, "NodeGroupOutput", {"Geometry": add(group, "GeometryNodeSetMaterial", painted)})
    node_group.note_structure(group)
    return group


def _material() -> bpy.types.Material:
    """Returns a material that shows the colours unchanged, whatever the light."""
    for material in bpy.data.materials:
        if material.get(MARK) and material.library is None:
            return material
    material = bpy.data.materials.new(NAME)
    material[MARK] = True
    if bpy.app.version < (5, 0):  # newer ones always have nodes
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    colour = add(tree, "ShaderNodeAttribute", attribute_name=NAME)
    light = add(tree, "ShaderNodeEmission", {"Color": colour})
    add(tree, "ShaderNodeOutputMaterial", {"Surface": light})
    return material
