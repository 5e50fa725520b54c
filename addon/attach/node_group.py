# SPDX-License-Identifier: GPL-3.0-or-later
"""The Geometry Nodes group "Sinew": sets each vertex to its point, from an attribute or from a point buffer.

There are separate groups with and without normals: without, a mesh whose normals Blender computes has no
nodes for them.
"""

import zlib

import bpy

from ..io import mesh_io

# A custom property on the group, by which a renamed or copied group is recognised; its value says where the
# group gets the points.
MARK = "sinew_node_group"
ATTRIBUTE, POINT_BUFFER = 13, 14
# What the names of Sinew's attributes start with.
OWN = ".sinew_"
# The group that marks a mesh, and the attribute that it adds. The heat map's has 15.
STACK_MARK, IN_STACK = 16, f"{OWN}in_stack"
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
        "In the stack, a mesh without rest positions is the undeformed one: it stays",
    ),
    MARK_TO_REMOVE: ("NodeSocketString", "Attribute of rest positions that is not needed behind"),
}
_SOCKETS = {
    ATTRIBUTE: {"Points": ("NodeSocketString", "Attribute that holds the deformed position of each vertex")},
    POINT_BUFFER: {
        "Points": ("NodeSocketObject", "Object whose vertices are the deformed positions"),
        "Upstream": (
            "NodeSocketObject",
            "Object that has the upstream modifiers, to be evaluated with this one",
        ),
    },
}
_NORMALS_SOCKET = ("NodeSocketString", "Attribute that holds the normals")
# What a node reads: a socket, or the first output of a node.
_Source = bpy.types.NodeSocket | bpy.types.Node
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
        return _make(kind, normals)
    # One that was appended has it from its file.
    _remove_warning(group)
    return group


def is_sinew(modifier: bpy.types.Modifier) -> bool:
    return (
        modifier.type == "NODES" and modifier.node_group is not None and bool(modifier.node_group.get(MARK))
    )


def get_or_make_stack_mark() -> bpy.types.NodeTree:
    """Returns the group that marks each mesh that Blender sends through the whole stack (undeformed.py)."""
    group = find(STACK_MARK)
    if group is None:
        group = new_group("Sinew Stack Mark", STACK_MARK, {})
        inputs = {"Geometry": add(group, "NodeGroupInput"), "Name": IN_STACK}
        marked = add(group, "GeometryNodeStoreNamedAttribute", inputs, data_type="BOOLEAN")
        add(group, "NodeGroupOutput", {"Geometry": marked})
        note_structure(group)
    return group


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
        geometry, output = last.from_socket, last.to_socket
        warning = add(group, "GeometryNodeWarning", {"Message": NEEDS_SINEW, "Show": True})
        # Blender does not evaluate a warning whose output is not used.
        user = _switch(group, warning, geometry, geometry)
        warning.name, user.name = _WARNING, _WARNING_USER
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


def add(
    group: bpy.types.NodeTree, kind: str, inputs: dict | None = None, **settings: object
) -> bpy.types.Node:
    """Adds a node.

    inputs    by the input's name or number: a value, a socket, or a node, whose first output is meant
    settings  the node's own, in the order in which they are to be set
    """
    node = group.nodes.new(kind)
    node.location = (220 * len(group.nodes), 0)
    for name, value in settings.items():
        setattr(node, name, value)
    for name, value in (inputs or {}).items():
        # A node can have several sockets of one name, one for each data type.
        named = (each for each in node.inputs if each.name == name and each.enabled)
        socket = node.inputs[name] if isinstance(name, int) else next(named)
        if isinstance(value, bpy.types.Node):
            value = next(output for output in value.outputs if output.enabled)
        if isinstance(value, bpy.types.NodeSocket):
            group.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def named_attribute(group: bpy.types.NodeTree, name: _Source | str) -> bpy.types.Node:
    return add(group, "GeometryNodeInputNamedAttribute", {"Name": name}, data_type="FLOAT_VECTOR")


def sample(
    group: bpy.types.NodeTree, geometry: _Source, value: _Source, index: _Source | int, domain: str = "POINT"
) -> bpy.types.Node:
    """Returns a node with a vector of another or the same geometry at an index."""
    inputs = {"Geometry": geometry, "Value": value, "Index": index}
    return add(group, "GeometryNodeSampleIndex", inputs, data_type="FLOAT_VECTOR", domain=domain)


def _logic(group: bpy.types.NodeTree, operation: str, first: _Source, second: _Source) -> bpy.types.Node:
    return add(group, "FunctionNodeBooleanMath", {0: first, 1: second}, operation=operation)


def _switch(group: bpy.types.NodeTree, which: _Source | bool, off: _Source, on: _Source) -> bpy.types.Node:
    inputs = {"Switch": which, "False": off, "True": on}
    return add(group, "GeometryNodeSwitch", inputs, input_type="GEOMETRY")


def _without_own(group: bpy.types.NodeTree, geometry: _Source, source: bpy.types.Node) -> bpy.types.Node:
    """Returns the geometry without what Sinew added: a subdivision behind would interpolate it for each of
    its vertices, and exports would contain it. One node for all of Sinew's names, as each takes its time."""
    kind, rest = "GeometryNodeRemoveAttribute", source.outputs[MARK_TO_REMOVE]
    own = add(group, kind, {"Geometry": add(group, kind, {"Geometry": geometry, "Name": rest})})
    if hasattr(own, "pattern_mode"):
        own.pattern_mode = "WILDCARD"
    else:  # Blender 5.3 made it an input
        own.inputs["Pattern Mode"].default_value = "Wildcard"
    own.inputs["Name"].default_value = f"{OWN}*"
    return own


def _make(kind: int, normals: str) -> bpy.types.NodeTree:
    makers = {ATTRIBUTE: ("Sinew", _of_attribute), POINT_BUFFER: ("Sinew Point Buffer", _of_buffer)}
    name, add_nodes = makers[kind]
    group = new_group(
        f"{name} with {normals.title()} Normals" if normals else name,
        kind + _WITH_NORMALS[normals],
        {
            **_SOCKETS[kind],
            **({NORMALS: _NORMALS_SOCKET} if normals and kind == ATTRIBUTE else {}),
            **({IN_RENDERS: IN_RENDERS_SOCKET} if normals else {}),
            **_MARK_SOCKETS,
            POSE: POSE_SOCKET,
        },
    )
    source = add(group, "NodeGroupInput")
    add(group, "NodeGroupOutput", {"Geometry": add_nodes(group, source, normals)})
    note_structure(group)
    return group


def _of_attribute(group: bpy.types.NodeTree, source: bpy.types.Node, normals: str) -> bpy.types.Node:
    given = source.outputs
    named = named_attribute(group, given["Points"])
    # Not Set Position, which would compute an offset for each point.
    moved = add(
        group,
        "GeometryNodeStoreNamedAttribute",
        {
            "Geometry": given["Geometry"],
            # A mesh without the attribute keeps its shape instead of collapsing to the origin.
            "Selection": _logic(group, "AND", named.outputs["Exists"], _is_deformed(group, source)),
            "Name": mesh_io.POSITION,
            "Value": named,
        },
        data_type="FLOAT_VECTOR",
    )
    if normals:
        named = named_attribute(group, given[NORMALS])
        first = sample(group, moved, named, 0, normals)
        moved = _with_normals(group, source, moved, named, first, normals)
    return _without_own(group, moved, source)


def _is_deformed(group: bpy.types.NodeTree, source: bpy.types.Node) -> bpy.types.Node:
    """Returns a field that says whether the mesh is the deformed one, or may be (undeformed.py)."""
    has_mark, is_in_stack = (
        named_attribute(group, name).outputs["Exists"] for name in (REST_POSITION, IN_STACK)
    )
    return _logic(group, "IMPLY", _logic(group, "AND", source.outputs[IS_MARKED], is_in_stack), has_mark)


def _with_normals(
    group: bpy.types.NodeTree,
    source: bpy.types.Node,
    geometry: _Source,
    normal: _Source,
    first: _Source,
    domain: str,
) -> bpy.types.Node:
    """Returns the geometry with these normals; unchanged where the first normal is 0, which means that Sinew
    gave none, and in renders where the normals are for the viewport only."""
    length = add(group, "ShaderNodeVectorMath", {0: first}, operation="LENGTH").outputs["Value"]
    is_given = add(group, "FunctionNodeCompare", {"A": length, "B": 0.5}, operation="GREATER_THAN")
    is_here = _logic(group, "OR", source.outputs[IN_RENDERS], add(group, "GeometryNodeIsViewport"))
    inputs = {"Mesh": geometry, "Custom Normal": normal}
    give = add(group, "GeometryNodeSetMeshNormal", inputs, mode="FREE", domain=domain)
    return _switch(group, _logic(group, "AND", is_given, is_here), geometry, give)


def _of_buffer(group: bpy.types.NodeTree, source: bpy.types.Node, normals: str) -> bpy.types.Node:
    given = source.outputs
    buffer = add(group, "GeometryNodeObjectInfo", {"Object": given["Points"]}).outputs["Geometry"]
    index, stored = add(group, "GeometryNodeInputIndex"), add(group, "GeometryNodeInputPosition")
    # Where the number of vertices differs, as before the first points are written, the shape is unchanged.
    fits = same_count(group, given["Geometry"], buffer, normals)
    place = add(
        group,
        "GeometryNodeSetPosition",
        {
            "Geometry": given["Geometry"],
            "Selection": _logic(group, "AND", fits, _is_deformed(group, source)),
            "Position": sample(group, buffer, stored, index),
        },
    )
    moved = _without_own(group, place, source)
    if normals:
        # They are those of the buffer's vertices behind the points.
        size = add(group, "GeometryNodeAttributeDomainSize", {"Geometry": moved}, component="MESH")
        count = size.outputs["Point Count"]
        normal = sample(group, buffer, stored, add(group, "FunctionNodeIntegerMath", {0: index, 1: count}))
        first = sample(group, buffer, stored, count)
        moved = _switch(group, fits, moved, _with_normals(group, source, moved, normal, first, normals))
    # This switch is never on: a node that names the object makes Blender evaluate it.
    upstream_proxy = add(group, "GeometryNodeObjectInfo", {"Object": given["Upstream"]})
    return _switch(group, False, moved, upstream_proxy.outputs["Geometry"])


def same_count(
    group: bpy.types.NodeTree, mesh: _Source, buffer: _Source, normals: str = ""
) -> bpy.types.Node:
    """Returns a node that says whether a buffer has as many vertices as a mesh.

    normals  the domain whose number of elements in the mesh is added; empty for none
    """
    of_mesh, of_buffer = (
        add(group, "GeometryNodeAttributeDomainSize", {"Geometry": geometry}, component="MESH").outputs
        for geometry in (mesh, buffer)
    )
    count = of_mesh["Point Count"]
    if normals:
        more = of_mesh["Face Corner Count" if normals == "CORNER" else "Point Count"]
        count = add(group, "FunctionNodeIntegerMath", {0: count, 1: more})
    inputs = {"A": count, "B": of_buffer["Point Count"]}
    return add(group, "FunctionNodeCompare", inputs, data_type="INT", operation="EQUAL")
