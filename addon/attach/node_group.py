# SPDX-License-Identifier: GPL-3.0-or-later
"""The Geometry Nodes group "Sinew": sets each vertex to its point, from an attribute or from a point buffer.

There are separate groups with and without normals: without, a mesh whose normals Blender computes has no
nodes for them.
"""

from __future__ import annotations

import zlib

import bpy

from ..io import mesh_io

# A custom property on the group, by which a renamed or copied group is recognised; its value says where the
# group gets the points.
MARK = "sinew_node_group"
ATTRIBUTE, POINT_BUFFER = 13, 14
# Added to the value where the group gives normals of this domain.
_WITH_NORMALS = {"": 0, "POINT": 30, "CORNER": 40}
# The input with the name of the normals attribute.
NORMALS = "Normals"
# The input that says whether normals are given in renders, too.
IN_RENDERS = "Normals in Renders"
# An input that no node reads; pose_driver puts its driver there.
POSE = "Pose"
# A custom property on the group: what it was made of, by which a group that was taken apart is recognised.
_MADE_OF = "sinew_made_of"
# What a group says to those who open the file without Sinew.
NEEDS_SINEW = (
    "This modifier needs the extension Sinew. Without it, leave the modifier off: the Armature modifier then "
    "deforms the mesh, as closely as Blender can."
)
# The nodes of add_warnings().
_WARNING, _WARNING_USER = "Sinew Is Missing", "User of Sinew Is Missing"

# Inputs that name a helper object, or an attribute where there is no helper.
_HELPER_INPUTS = ("Points", "Upstream")

# Blender's attribute of Add Rest Position, by which undeformed.py marks the deformed mesh.
REST_POSITION = "rest_position"
# The inputs that say whether it does, and which attribute is not needed behind.
IS_MARKED, MARK_TO_REMOVE = "Is Marked", "Mark to Remove"
_MARK_SOCKETS = {
    IS_MARKED: (
        "NodeSocketBool",
        "In renders, a mesh without rest positions is the undeformed one: it stays",
    ),
    MARK_TO_REMOVE: ("NodeSocketString", "Attribute of rest positions that is not needed behind"),
}
POSE_SOCKET = ("NodeSocketFloat", "Carries the driver by which Blender requests the points from Sinew")
IN_RENDERS_SOCKET = (
    "NodeSocketBool",
    "Off where a modifier that is on in renders alone needs Blender's",
)


def find(kind: int) -> bpy.types.NodeTree | None:
    """Returns a whole one."""
    return next((g for g in _own() if g[MARK] == kind and not _is_taken_apart(g)), None)


def _own() -> list[bpy.types.NodeTree]:
    return [g for g in bpy.data.node_groups if g.get(MARK) and g.library is None]


def get_or_make(kind: int, normals: str = "") -> bpy.types.NodeTree:
    """Returns the group that takes points from an ATTRIBUTE or from a POINT_BUFFER.

    normals  the domain of normals that it also takes, POINT or CORNER; empty for none. Needs Blender 4.5
    """
    group = find(kind + _WITH_NORMALS[normals])
    if group is None:
        made = _make_for_attribute(normals) if kind == ATTRIBUTE else _make_for_buffer(normals)
        note_structure(made)
        return made
    # One that was appended has it from its file.
    _remove_warning(group)
    return group


def is_sinew(modifier: bpy.types.Modifier) -> bool:
    return (
        modifier.type == "NODES" and modifier.node_group is not None and bool(modifier.node_group.get(MARK))
    )


def note_structure(group: bpy.types.NodeTree) -> None:
    """Called when a group is complete."""
    group[_MADE_OF] = _structure(group)


def taken_apart() -> list[bpy.types.NodeTree]:
    """Returns the groups in which somebody changed nodes, links or sockets: they no longer set points."""
    return list(filter(_is_taken_apart, _own()))


def _is_taken_apart(group: bpy.types.NodeTree) -> bool:
    return _WARNING not in group.nodes and group.get(_MADE_OF) not in (None, _structure(group))


def _structure(group: bpy.types.NodeTree) -> str:
    nodes = sorted(
        (node.name, node.bl_idname, node.mute, getattr(node, "node_tree", group) is None)
        for node in group.nodes
        if node.type != "FRAME"
    )
    links = sorted(
        (
            *(link.from_node.name, link.from_socket.identifier),
            *(link.to_node.name, link.to_socket.identifier, link.is_muted),
        )
        for link in group.links
    )
    sockets = [
        (item.identifier, item.in_out, item.socket_type)
        for item in group.interface.items_tree
        if item.item_type == "SOCKET"
    ]
    return f"{zlib.crc32(repr((nodes, links, sockets)).encode()):08x}"


def remove_unused() -> None:
    # Removing one group can leave another unused.
    while groups := [group for group in _own() if group.users == 0]:
        for group in groups:
            bpy.data.node_groups.remove(group)


def set_inputs(modifier: bpy.types.Modifier, values: dict[str, object]) -> None:
    """Sets inputs of a Sinew modifier by name. Unchanged ones are not set, as every change makes Blender
    evaluate the object."""
    changed = [name for name, value in values.items() if get_input(modifier, name) != value]
    for name in changed:
        identifier = _identifier(modifier, name)
        if hasattr(modifier, "properties"):  # Blender 5.2 moved the inputs
            getattr(modifier.properties.inputs, identifier).value = values[name]
        else:
            modifier[identifier] = values[name]
    if changed:
        # Setting an input alone makes Blender neither evaluate the object nor add the dependency on an input
        # object.
        modifier.node_group = modifier.node_group


def get_input(modifier: bpy.types.Modifier, name: str) -> object:
    """Returns None where the modifier has no such input."""
    identifier = _identifier(modifier, name)
    if identifier is None:
        return None
    if hasattr(modifier, "properties"):
        return getattr(modifier.properties.inputs, identifier).value
    return modifier.get(identifier)


def forget_helpers(modifier: bpy.types.Modifier) -> None:
    """Clears the inputs that name an object."""
    named = [n for n in _HELPER_INPUTS if isinstance(get_input(modifier, n), bpy.types.Object)]
    set_inputs(modifier, dict.fromkeys(named))


def input_path(modifier: bpy.types.Modifier, name: str) -> str:
    """Returns the data path of an input, relative to the modifier's object, for a driver."""
    start = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"]'
    identifier = _identifier(modifier, name)
    if hasattr(modifier, "properties"):
        return f"{start}.properties.inputs.{identifier}.value"
    return f'{start}["{identifier}"]'


def _identifier(modifier: bpy.types.Modifier, name: str) -> str | None:
    if modifier.node_group is None:
        return None
    return next(
        (
            item.identifier
            for item in modifier.node_group.interface.items_tree
            if item.item_type == "SOCKET" and item.in_out == "INPUT" and item.name == name
        ),
        None,
    )


def add_warnings() -> None:
    """Has Sinew's modifiers warn that Sinew is missing, from Blender 4.3 on. For saved files alone, as the
    nodes cost time in each frame. They must not be there already."""
    if not hasattr(bpy.types, "GeometryNodeWarning"):
        return
    for group in _groups_of_points():
        last = _last_link(group)
        # An artist may have taken the group apart.
        if last is None:
            continue
        warning, user = add_nodes(group, "GeometryNodeWarning", "GeometryNodeSwitch")
        warning.name, user.name, user.input_type = _WARNING, _WARNING_USER, "GEOMETRY"
        warning.inputs["Message"].default_value = NEEDS_SINEW
        warning.inputs["Show"].default_value = True
        geometry, output = last.from_socket, last.to_socket
        # Blender does not evaluate a warning whose output is not used.
        group.links.new(warning.outputs["Show"], user.inputs["Switch"])
        group.links.new(geometry, user.inputs["False"])
        group.links.new(geometry, user.inputs["True"])
        group.links.new(user.outputs["Output"], output)


def remove_warnings() -> None:
    """Reverses add_warnings()."""
    for group in _groups_of_points():
        _remove_warning(group)


def _remove_warning(group: bpy.types.NodeTree) -> None:
    user, last = group.nodes.get(_WARNING_USER), _last_link(group)
    if user is not None and last is not None and last.from_node == user and user.inputs["False"].links:
        group.links.new(user.inputs["False"].links[0].from_socket, last.to_socket)
    for name in (_WARNING_USER, _WARNING):
        if name in group.nodes:
            group.nodes.remove(group.nodes[name])


def _last_link(group: bpy.types.NodeTree) -> bpy.types.NodeLink | None:
    """Returns the link that leads to the group's output."""
    # An artist may have renamed the socket, or removed it.
    outputs = (node.inputs[0] for node in group.nodes if node.type == "GROUP_OUTPUT" and len(node.inputs))
    return next((link for output in outputs for link in output.links), None)


def _groups_of_points() -> list[bpy.types.NodeTree]:
    kinds = {kind + normals for kind in (ATTRIBUTE, POINT_BUFFER) for normals in _WITH_NORMALS.values()}
    return [group for group in _own() if group[MARK] in kinds]


def new_group(name: str, kind: int, inputs: dict[str, tuple[str, str]]) -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group[MARK] = kind
    # Keeps it out of Blender's menu of modifiers: on other objects it does nothing.
    group.is_modifier = False
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    for socket, (socket_type, description) in inputs.items():
        made = group.interface.new_socket(socket, in_out="INPUT", socket_type=socket_type)
        made.description = description
        made.hide_in_modifier = True
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    frame = group.nodes.new("NodeFrame")
    frame.label, frame.label_size, frame.location = NEEDS_SINEW, 20, (0, 300)
    return group


def add_nodes(group: bpy.types.NodeTree, *kinds: str) -> list[bpy.types.Node]:
    nodes = [group.nodes.new(kind) for kind in kinds]
    for column, node in enumerate(nodes):
        node.location = (220 * column, 0)
    return nodes


def _make_for_attribute(normals: str) -> bpy.types.NodeTree:
    group = new_group(
        _name("Sinew", normals),
        ATTRIBUTE + _WITH_NORMALS[normals],
        {
            "Points": ("NodeSocketString", "Attribute that holds the deformed position of each vertex"),
            **({NORMALS: ("NodeSocketString", "Attribute that holds the normals")} if normals else {}),
            **({IN_RENDERS: IN_RENDERS_SOCKET} if normals else {}),
            **_MARK_SOCKETS,
            POSE: POSE_SOCKET,
        },
    )
    # Not Set Position, which would compute an offset for each point.
    source, named, place, remove, result = add_nodes(
        group,
        "NodeGroupInput",
        "GeometryNodeInputNamedAttribute",
        "GeometryNodeStoreNamedAttribute",
        "GeometryNodeRemoveAttribute",
        "NodeGroupOutput",
    )
    named.data_type = place.data_type = "FLOAT_VECTOR"
    place.inputs["Name"].default_value = mesh_io.POSITION
    group.links.new(source.outputs["Points"], named.inputs["Name"])
    group.links.new(source.outputs["Geometry"], place.inputs["Geometry"])
    group.links.new(named.outputs["Attribute"], enabled_socket(place.inputs, "Value"))
    # A mesh without the attribute keeps its shape instead of collapsing to the origin.
    group.links.new(
        _both(group, named.outputs["Exists"], _is_deformed(group, source)), place.inputs["Selection"]
    )
    # Removed, as a subdivision behind would interpolate it for each of its vertices, and exports would
    # contain it.
    group.links.new(source.outputs["Points"], remove.inputs["Name"])
    group.links.new(place.outputs["Geometry"], remove.inputs["Geometry"])
    moved = _without_mark(group, source, remove.outputs["Geometry"])
    if normals:
        moved = _take_normals_of_attribute(group, source, moved, normals)
    group.links.new(moved, result.inputs["Geometry"])
    return group


def _is_deformed(group: bpy.types.NodeTree, source: bpy.types.Node) -> bpy.types.NodeSocket:
    """Returns a field that says whether the mesh is the deformed one, or may be (undeformed.py)."""
    named, view, implied, either = add_nodes(
        group,
        "GeometryNodeInputNamedAttribute",
        "GeometryNodeIsViewport",
        "FunctionNodeBooleanMath",
        "FunctionNodeBooleanMath",
    )
    named.data_type, named.inputs["Name"].default_value = "FLOAT_VECTOR", REST_POSITION
    implied.operation, either.operation = "IMPLY", "OR"
    link = group.links.new
    link(source.outputs[IS_MARKED], implied.inputs[0])
    link(named.outputs["Exists"], implied.inputs[1])
    link(view.outputs[0], either.inputs[0])
    link(implied.outputs[0], either.inputs[1])
    return either.outputs[0]


def _both(
    group: bpy.types.NodeTree, first: bpy.types.NodeSocket, second: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    (both,) = add_nodes(group, "FunctionNodeBooleanMath")
    both.operation = "AND"
    group.links.new(first, both.inputs[0])
    group.links.new(second, both.inputs[1])
    return both.outputs[0]


def _without_mark(
    group: bpy.types.NodeTree, source: bpy.types.Node, geometry: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    (remove,) = add_nodes(group, "GeometryNodeRemoveAttribute")
    group.links.new(source.outputs[MARK_TO_REMOVE], remove.inputs["Name"])
    group.links.new(geometry, remove.inputs["Geometry"])
    return remove.outputs["Geometry"]


def _take_normals_of_attribute(
    group: bpy.types.NodeTree, source: bpy.types.Node, geometry: bpy.types.NodeSocket, domain: str
) -> bpy.types.NodeSocket:
    named, remove = add_nodes(group, "GeometryNodeInputNamedAttribute", "GeometryNodeRemoveAttribute")
    named.data_type = "FLOAT_VECTOR"
    link = group.links.new
    link(source.outputs[NORMALS], named.inputs["Name"])
    normal = named.outputs["Attribute"]
    first = _sample(group, geometry, normal, domain)
    link(source.outputs[NORMALS], remove.inputs["Name"])
    given = _with_normals(group, geometry, normal, first, source.outputs[IN_RENDERS], domain)
    link(given, remove.inputs["Geometry"])
    return remove.outputs["Geometry"]


def _with_normals(
    group: bpy.types.NodeTree,
    geometry: bpy.types.NodeSocket,
    normal: bpy.types.NodeSocket,
    first: bpy.types.NodeSocket,
    in_renders: bpy.types.NodeSocket,
    domain: str,
) -> bpy.types.NodeSocket:
    """Returns the geometry with these normals; unchanged where the first normal is 0, which means that Sinew
    gave none, and in renders where the normals are for the viewport only."""
    length, is_given, view, is_here, both, give, choice = add_nodes(
        group,
        "ShaderNodeVectorMath",
        "FunctionNodeCompare",
        "GeometryNodeIsViewport",
        "FunctionNodeBooleanMath",
        "FunctionNodeBooleanMath",
        "GeometryNodeSetMeshNormal",
        "GeometryNodeSwitch",
    )
    is_here.operation, both.operation = "OR", "AND"
    length.operation, is_given.data_type, is_given.operation = "LENGTH", "FLOAT", "GREATER_THAN"
    give.mode, give.domain, choice.input_type = "FREE", domain, "GEOMETRY"
    enabled_socket(is_given.inputs, "B").default_value = 0.5
    link = group.links.new
    link(first, length.inputs[0])
    link(length.outputs["Value"], enabled_socket(is_given.inputs, "A"))
    link(geometry, give.inputs["Mesh"])
    link(normal, enabled_socket(give.inputs, "Custom Normal"))
    link(in_renders, is_here.inputs[0])
    link(view.outputs[0], is_here.inputs[1])
    link(is_given.outputs["Result"], both.inputs[0])
    link(is_here.outputs[0], both.inputs[1])
    link(both.outputs[0], choice.inputs["Switch"])
    link(geometry, choice.inputs["False"])
    link(give.outputs["Mesh"], choice.inputs["True"])
    return choice.outputs["Output"]


def _sample(
    group: bpy.types.NodeTree,
    geometry: bpy.types.NodeSocket,
    value: bpy.types.NodeSocket,
    domain: str,
    index: bpy.types.NodeSocket | None = None,
) -> bpy.types.NodeSocket:
    """Returns a vector of another or the same geometry at an index; the first one where the index is None."""
    (sample,) = add_nodes(group, "GeometryNodeSampleIndex")
    sample.data_type, sample.domain = "FLOAT_VECTOR", domain
    group.links.new(geometry, sample.inputs["Geometry"])
    group.links.new(value, enabled_socket(sample.inputs, "Value"))
    if index is not None:
        group.links.new(index, sample.inputs["Index"])
    return enabled_socket(sample.outputs, "Value")


def _name(name: str, normals: str) -> str:
    return f"{name} with {normals.title()} Normals" if normals else name


def _make_for_buffer(normals: str) -> bpy.types.NodeTree:
    group = new_group(
        _name("Sinew Point Buffer", normals),
        POINT_BUFFER + _WITH_NORMALS[normals],
        {
            "Points": ("NodeSocketObject", "Object whose vertices are the deformed positions"),
            "Upstream": (
                "NodeSocketObject",
                "Object that has the upstream modifiers, to be evaluated with this one",
            ),
            **({IN_RENDERS: IN_RENDERS_SOCKET} if normals else {}),
            **_MARK_SOCKETS,
            POSE: POSE_SOCKET,
        },
    )
    source, info, index, position, place, result = add_nodes(
        group,
        "NodeGroupInput",
        "GeometryNodeObjectInfo",
        "GeometryNodeInputIndex",
        "GeometryNodeInputPosition",
        "GeometryNodeSetPosition",
        "NodeGroupOutput",
    )
    link = group.links.new
    link(source.outputs["Points"], info.inputs["Object"])
    buffer, stored = info.outputs["Geometry"], position.outputs["Position"]
    link(_sample(group, buffer, stored, "POINT", index.outputs["Index"]), place.inputs["Position"])
    link(source.outputs["Geometry"], place.inputs["Geometry"])
    # Where the number of vertices differs, as before the first points are written, the shape is unchanged.
    fits = same_count(group, source.outputs["Geometry"], buffer, normals)
    link(_both(group, fits, _is_deformed(group, source)), place.inputs["Selection"])
    moved = _without_mark(group, source, place.outputs["Geometry"])
    if normals:
        moved = _take_normals_of_buffer(
            group, source, moved, buffer, stored, index.outputs["Index"], fits, normals
        )
    # This switch is never on: a node that names the object makes Blender evaluate it.
    upstream_proxy, choice = add_nodes(group, "GeometryNodeObjectInfo", "GeometryNodeSwitch")
    choice.input_type = "GEOMETRY"
    link(source.outputs["Upstream"], upstream_proxy.inputs["Object"])
    link(moved, choice.inputs["False"])
    link(upstream_proxy.outputs["Geometry"], choice.inputs["True"])
    link(choice.outputs["Output"], result.inputs["Geometry"])
    return group


def _take_normals_of_buffer(
    group: bpy.types.NodeTree,
    source: bpy.types.Node,
    geometry: bpy.types.NodeSocket,
    buffer: bpy.types.NodeSocket,
    stored: bpy.types.NodeSocket,
    index: bpy.types.NodeSocket,
    fits: bpy.types.NodeSocket,
    domain: str,
) -> bpy.types.NodeSocket:
    """Takes the normals from the buffer's vertices behind the points."""
    size, behind, choice = add_nodes(
        group, "GeometryNodeAttributeDomainSize", "FunctionNodeIntegerMath", "GeometryNodeSwitch"
    )
    size.component, choice.input_type = "MESH", "GEOMETRY"
    link = group.links.new
    link(geometry, size.inputs["Geometry"])
    link(index, behind.inputs[0])
    link(size.outputs["Point Count"], behind.inputs[1])
    normal = _sample(group, buffer, stored, "POINT", behind.outputs["Value"])
    first = _sample(group, buffer, stored, "POINT", size.outputs["Point Count"])
    link(fits, choice.inputs["Switch"])
    link(geometry, choice.inputs["False"])
    given = _with_normals(group, geometry, normal, first, source.outputs[IN_RENDERS], domain)
    link(given, choice.inputs["True"])
    return choice.outputs["Output"]


def same_count(
    group: bpy.types.NodeTree, mesh: bpy.types.NodeSocket, buffer: bpy.types.NodeSocket, normals: str = ""
) -> bpy.types.NodeSocket:
    """Returns a socket that says whether a buffer has as many vertices as a mesh.

    normals  the domain whose number of elements in the mesh is added; empty for none
    """
    of_mesh, of_buffer, equal = add_nodes(
        group, "GeometryNodeAttributeDomainSize", "GeometryNodeAttributeDomainSize", "FunctionNodeCompare"
    )
    equal.data_type, equal.operation = "INT", "EQUAL"
    link = group.links.new
    for size, geometry in ((of_mesh, mesh), (of_buffer, buffer)):
        size.component = "MESH"
        link(geometry, size.inputs["Geometry"])
    count = of_mesh.outputs["Point Count"]
    if normals:
        (both,) = add_nodes(group, "FunctionNodeIntegerMath")
        link(count, both.inputs[0])
        link(of_mesh.outputs["Face Corner Count" if normals == "CORNER" else "Point Count"], both.inputs[1])
        count = both.outputs["Value"]
    link(count, enabled_socket(equal.inputs, "A"))
    link(of_buffer.outputs["Point Count"], enabled_socket(equal.inputs, "B"))
    return equal.outputs["Result"]


def enabled_socket(sockets: bpy.types.bpy_prop_collection, name: str) -> bpy.types.NodeSocket:
    """Returns the enabled socket of a node that has several sockets of that name, one for each data type."""
    return next(socket for socket in sockets if socket.name == name and socket.enabled)
