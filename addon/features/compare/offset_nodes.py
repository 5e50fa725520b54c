# SPDX-License-Identifier: GPL-3.0-or-later
"""The Geometry Nodes group "Sinew Offset": moves an object's evaluated geometry, in world axes, and does not
move the object, as the bones' motions are relative to it."""

import functools

import bpy
import numpy as np

from ...attach import node_group, stack

# A custom property on the group, by which a renamed group is recognised.
MARK = "sinew_offset"


def find(obj: bpy.types.Object) -> bpy.types.NodesModifier | None:
    return stack.of_nodes(obj, _is_ours)


def add(obj: bpy.types.Object) -> None:
    """Adds the modifier behind all others except a Subdivision at the end: its result is the same, and only
    at the end Blender subdivides on the graphics card."""
    modifier = stack.add_last_but(obj, "SUBSURF", "Offset", "NODES")
    modifier.node_group = next((g for g in bpy.data.node_groups if _is_ours(g)), None) or _make()
    modifier.show_expanded = False


def set_offset(obj: bpy.types.Object, offset: tuple[float, float, float]) -> None:
    """Sets the world-space offset of an object for which add() was called."""
    modifier = find(obj)
    if modifier is None or np.allclose(node_group.get_input(modifier, "Offset"), offset, 1e-6, 0.0):
        # Nothing would move, but Blender would evaluate it again.
        return
    node_group.set_inputs(modifier, {"Offset": offset})
    obj.update_tag(refresh={"DATA"})


def remove_unused() -> None:
    for group in [g for g in bpy.data.node_groups if _is_ours(g) and g.users == 0]:
        bpy.data.node_groups.remove(group)


def _is_ours(group: bpy.types.NodeTree | None) -> bool:
    return group is not None and group.library is None and bool(group.get(MARK))


def _make() -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new("Sinew Offset", "GeometryNodeTree")
    group[MARK] = True
    group.is_modifier = True
    socket = group.interface.new_socket
    socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    offset = socket("Offset", in_out="INPUT", socket_type="NodeSocketVector")
    offset.subtype = "TRANSLATION"
    offset.description = "In the world's axes"
    socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    add = functools.partial(node_group.add, group)
    source = add("NodeGroupInput").outputs
    own = add("GeometryNodeSelfObject")
    info = add("GeometryNodeObjectInfo", {"Object": own}, transform_space="ORIGINAL")
    inverse = add("FunctionNodeInvertMatrix", {"Matrix": info.outputs["Transform"]})
    turned = {"Direction": source["Offset"], "Transform": inverse}
    turn = add("FunctionNodeTransformDirection", turned)
    moved = {"Geometry": source["Geometry"], "Translation": turn}
    add("NodeGroupOutput", {"Geometry": add("GeometryNodeTransform", moved)})
    return group
