# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Generated texture coordinates at the rest shape in renders.

Blender sends the undeformed mesh, from which they are made, through all modifiers that do more than deform,
so through Sinew's, too. It does so only where a modifier that just deforms is on; else it takes the deformed
points (BKE_modifier_calc_data_masks and mesh_calc_modifiers in Blender's sources, 4.2 to 5.2). So behind
Sinew's modifier stands one that changes nothing, in no time: a Laplacian Deform that is not bound. And the
option Add Rest Position of the object adds an attribute to the deformed mesh alone. Without it, Sinew's node
group leaves a mesh as it is.

Not in viewports: applying Sinew's modifier evaluates it there, on a mesh that has not that attribute either.
Nodes can tell the two apart only where the mesh has a Texture Space Mesh: another mesh in the file, which
would have to follow each edit of the first, and which neither undo nor saving could leave as it is.
"""

from __future__ import annotations

import bpy

from ..io import mesh_io
from . import node_group, properties, stack


def ensure(obj: bpy.types.Object) -> dict[str, object]:
    """Makes the modifier behind Sinew's, and returns inputs of Sinew's."""
    if stack.neutral_modifier(obj) is None and _can_make(obj):
        _make(obj)
    position(obj)
    can_mark = _can_mark(obj)
    keeps = properties.of(obj).adds_rest_position or not can_mark
    return {
        node_group.IS_MARKED: can_mark,
        node_group.MARK_TO_REMOVE: "" if keeps else node_group.REST_POSITION,
    }


def _can_make(obj: bpy.types.Object) -> bool:
    if obj.vertex_groups:
        return True
    # With its last group a mesh would lose weights that belong to none.
    return obj.data.is_editable and not mesh_io.read_group_weights(obj.data).counts.any()


def _make(obj: bpy.types.Object) -> None:
    active = obj.modifiers.active
    neutral = obj.modifiers.new("Sinew Texture Coordinates", "LAPLACIANDEFORM")
    # Blender calls one without a group's name disabled. The group itself is not needed.
    made = None if obj.vertex_groups else obj.vertex_groups.new(name="Sinew")
    neutral.vertex_group = obj.vertex_groups[0].name
    if made is not None:
        obj.vertex_groups.remove(made)
    neutral.show_expanded = neutral.show_in_editmode = False
    neutral.show_viewport = neutral.show_render = False
    properties.of(obj).neutral_uid = neutral.persistent_uid
    if active is not None:
        obj.modifiers.active = active


def position(obj: bpy.types.Object) -> None:
    """Moves it directly behind Sinew's modifier."""
    nodes, neutral = stack.sinew_modifier(obj), stack.neutral_modifier(obj)
    if nodes is not None and neutral is not None:
        stack.move_behind(obj, neutral, nodes)


def mark(obj: bpy.types.Object, is_marked: bool) -> None:
    """Switches Add Rest Position on, or back to what the artist chose, also meanwhile."""
    settings, is_on = properties.of(obj), obj.add_rest_position_attribute
    is_marked = is_marked and _can_mark(obj)
    if not settings.marks_rest and not is_marked:
        return
    own = is_on and (settings.adds_rest_position or not settings.marks_rest)
    properties.store(settings, "adds_rest_position", own)
    properties.store(settings, "marks_rest", is_marked)
    if is_on != (is_marked or own):
        obj.add_rest_position_attribute = is_marked or own


def _can_mark(obj: bpy.types.Object) -> bool:
    # Blender's would replace one of the artist's.
    return mesh_io.find_attribute(obj.data, node_group.REST_POSITION) is None


def remove(obj: bpy.types.Object) -> None:
    mark(obj, False)
    neutral = stack.neutral_modifier(obj)
    if neutral is not None:
        obj.modifiers.remove(neutral)


# The session_uid of each object that remove_later() was called for.
_to_remove: set[int] = set()


def remove_later(obj: bpy.types.Object) -> None:
    """Called where Sinew's modifier was applied or deleted: a script that goes through a list of modifiers
    would crash Blender where another of these is gone."""
    mark(obj, False)
    neutral = stack.neutral_modifier(obj)
    if neutral is not None:
        neutral.show_viewport = neutral.show_render = False
        _to_remove.add(obj.session_uid)
        if not bpy.app.background and not bpy.app.timers.is_registered(remove_leftovers):
            bpy.app.timers.register(remove_leftovers)


def has_leftovers() -> bool:
    return bool(_to_remove)


def remove_leftovers() -> None:
    """Called when no script runs; without a window, at the next frame and before the file is saved."""
    if not has_leftovers():
        return
    for obj in [each for each in bpy.data.objects if each.session_uid in _to_remove]:
        neutral = stack.neutral_modifier(obj)
        if neutral is not None and not properties.has_sinew(obj):
            obj.modifiers.remove(neutral)
    _to_remove.clear()
