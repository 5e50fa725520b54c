# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Generated texture coordinates at the rest shape.

Blender sends the undeformed mesh, from which they are made, through all modifiers that do more than deform,
so through Sinew's, too. It does so only where a modifier that just deforms is on; else it takes the deformed
points (BKE_modifier_calc_data_masks and mesh_calc_modifiers in Blender's sources, 4.2 to 5.2). So behind
Sinew's modifier stands one that changes nothing, in no time: a Laplacian Deform that is not bound. And the
option Add Rest Position of the object adds an attribute to the deformed mesh alone. Without it, Sinew's node
group leaves a mesh as it is.

Applying Sinew's modifier evaluates it alone, on a mesh without that attribute, too. So in front of Sinew's
modifier stands one that marks each mesh that goes through the whole stack: one without this mark is deformed.
"""

import fnmatch
from collections.abc import Iterator

import bpy

from ..io import mesh_io
from . import layout, node_group, properties, property_groups, references, stack

# These make a mesh that has none of the attributes of what they get.
_MAKE_A_MESH = {
    *("MESH_SEQUENCE_CACHE", "OCEAN", "PARTICLE_INSTANCE", "REMESH", "SCREW", "SKIN", "VOLUME_TO_MESH"),
}
# These nodes give a mesh with weights that comes from elsewhere, or from an earlier evaluation.
_OTHER_MESHES = {
    *("GeometryNodeObjectInfo", "GeometryNodeCollectionInfo", "GeometryNodeBake"),
    "GeometryNodeSimulationOutput",
}


def ensure(obj: bpy.types.Object, now: layout.Layout) -> tuple[layout.Layout, dict[str, object]]:
    """Makes the modifiers around Sinew's. Returns the layout after that, and inputs of Sinew's."""
    if not now.neutral and _can_make(obj):
        _make_neutral(obj)
    _ensure_mark(obj, now)
    now = stack.position_own(obj, now if now.neutral and now.mark else layout.read(obj))
    is_marked = can_mark(obj) and not loses_marks(obj, now)
    keeps = properties.of(obj).before.adds_rest_position or not is_marked
    return now, {
        node_group.IS_MARKED: is_marked,
        node_group.MARK_TO_REMOVE: "" if keeps else node_group.REST_POSITION,
    }


def loses_marks(obj: bpy.types.Object, now: layout.Layout) -> bool:
    """Whether modifiers in front can make another mesh, without the attribute: then the mesh can not be told
    from the undeformed one."""
    changes = now.changes_ahead
    groups = [obj.modifiers[modifier.name].node_group for modifier in changes if modifier.kind == "NODES"]
    by_envelopes = any(obj.modifiers[name].use_bone_envelopes for name in now.replaced)
    return (
        not _MAKE_A_MESH.isdisjoint(modifier.kind for modifier in changes)
        or (by_envelopes and bool(groups))
        or any(_loses_mark(node) for node in _nodes_of(groups))
    )


def _nodes_of(groups: list[bpy.types.NodeTree | None]) -> Iterator[bpy.types.Node]:
    """Yields the nodes of groups and of all groups in them."""
    known = set()
    while groups:
        group = groups.pop()
        if group is not None and group not in known:
            known.add(group)
            yield from group.nodes
            groups += [node.node_tree for node in group.nodes if node.bl_idname == "GeometryNodeGroup"]


def _loses_mark(node: bpy.types.Node) -> bool:
    """Other nodes pass the attribute on where they pass on weights."""
    if node.bl_idname == "GeometryNodeRemoveAttribute":
        name = node.inputs["Name"]
        return name.is_linked or fnmatch.fnmatchcase(node_group.REST_POSITION, name.default_value)
    return node.bl_idname in _OTHER_MESHES and any(
        output.type == "GEOMETRY" and output.is_linked for output in node.outputs
    )


def _can_make(obj: bpy.types.Object) -> bool:
    if obj.vertex_groups:
        return True
    # With its last group a mesh would lose weights that belong to none.
    return obj.data.is_editable and not mesh_io.read_group_weights(obj.data).counts.any()


def _make_neutral(obj: bpy.types.Object) -> None:
    neutral = _new(obj, "Sinew Texture Coordinates", "LAPLACIANDEFORM")
    # Blender calls one without a group's name disabled. The group itself is not needed.
    made = None if obj.vertex_groups else obj.vertex_groups.new(name="Sinew")
    neutral.vertex_group = obj.vertex_groups[0].name
    if made is not None:
        obj.vertex_groups.remove(made)
    properties.of(obj).stack.neutral_uid = neutral.persistent_uid


def _ensure_mark(obj: bpy.types.Object, now: layout.Layout) -> None:
    mark = obj.modifiers.get(now.mark) or _new(obj, layout.MARK_NAME, "NODES")
    property_groups.store(properties.of(obj).stack, "mark_uid", mark.persistent_uid)
    group = node_group.get_or_make_stack_mark()
    if mark.node_group != group:
        references.note(obj)
        mark.node_group = group
    if obj.data.is_editable and mesh_io.find_attribute(obj.data, node_group.IN_STACK) is not None:
        # Somebody has applied it.
        mesh_io.remove_attribute(obj.data, node_group.IN_STACK)


def _new(obj: bpy.types.Object, name: str, kind: str) -> bpy.types.Modifier:
    active = obj.modifiers.active
    made = obj.modifiers.new(name, kind)
    made.show_expanded = made.show_in_editmode = made.show_viewport = made.show_render = False
    obj.modifiers.active = active
    return made


# The session_uid of each object of whose helping modifiers somebody has switched one.
_switched: set[int] = set()


def switch(obj: bpy.types.Object, now: layout.Layout, icon: str, is_on: bool, is_clicked: bool) -> None:
    """Switches the helping modifiers on or off, and notes where somebody has switched one.

    icon        show_viewport or show_render
    is_clicked  Sinew's own modifier was switched, which they may follow
    """
    for modifier in (obj.modifiers[name] for name in now.helping):
        if getattr(modifier, icon) != is_on and not is_clicked:
            _switched.add(obj.session_uid)
        property_groups.assign(modifier, icon, is_on)


def was_switched(obj: bpy.types.Object) -> bool:
    return obj.session_uid in _switched


def mark(obj: bpy.types.Object, is_marked: bool) -> None:
    """Switches Add Rest Position on, or back to what the artist chose, also meanwhile."""
    before = properties.of(obj).before
    is_marked = is_marked and can_mark(obj)
    if not before.marks_rest and not is_marked:
        return
    own = adds_rest_position(obj)
    property_groups.store(before, "adds_rest_position", own)
    property_groups.store(before, "marks_rest", is_marked)
    property_groups.assign(obj, "add_rest_position_attribute", is_marked or own)


def adds_rest_position(obj: bpy.types.Object) -> bool:
    """Whether the artist switched Add Rest Position on."""
    before = properties.of(obj).before
    return obj.add_rest_position_attribute and (before.adds_rest_position or not before.marks_rest)


def can_mark(obj: bpy.types.Object) -> bool:
    """Whether Add Rest Position can be on for Sinew's marks."""
    # Blender's would replace one of the artist's.
    return mesh_io.find_attribute(obj.data, node_group.REST_POSITION) is None


def remove(obj: bpy.types.Object) -> None:
    mark(obj, False)
    for modifier in stack.helping_modifiers(obj):
        obj.modifiers.remove(modifier)


# The session_uid of each object that remove_later() was called for.
_to_remove: set[int] = set()


def remove_later(obj: bpy.types.Object) -> None:
    """Called where Sinew's modifier was applied or deleted: a script that goes through a list of modifiers
    would crash Blender where another of these is gone."""
    mark(obj, False)
    for modifier in stack.helping_modifiers(obj):
        modifier.show_viewport = modifier.show_render = False
        _to_remove.add(obj.session_uid)
    if _to_remove and not bpy.app.background and not bpy.app.timers.is_registered(remove_leftovers):
        bpy.app.timers.register(remove_leftovers)


def find_leftovers() -> None:
    """Called after undo and redo, which can bring back what remove_later() left until later."""
    for obj in bpy.data.objects:
        # For all meshes of a file, this is far quicker than their layouts.
        if obj.type == "MESH" and not properties.has_sinew(obj) and stack.of_nodes(obj, _marks) is not None:
            remove_later(obj)


def _marks(group: bpy.types.NodeTree | None) -> bool:
    return group is not None and group.get(node_group.MARK) == node_group.STACK_MARK


def has_leftovers() -> bool:
    return bool(_to_remove)


def remove_leftovers() -> None:
    """Called when no script runs; without a window, at the next frame and before the file is saved."""
    if not has_leftovers():
        return
    for obj in bpy.data.objects:
        if obj.session_uid in _to_remove and not properties.has_sinew(obj):
            for modifier in stack.helping_modifiers(obj):
                obj.modifiers.remove(modifier)
            # Reading settings makes them.
            properties.clear(obj)
    _to_remove.clear()
