# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores the deformed points of an object, and its normals, where Sinew's modifier reads them.

They are stored in an attribute of the mesh; or in a point buffer, where the mesh is not the object's own or
not what is deformed. Within Blender's evaluation they are written to the evaluated attribute or buffer, so
that a frame changes no mesh of the file.
"""

import bpy
import numpy as np

from ..io import mesh_io
from . import (
    layout,
    node_group,
    point_buffer,
    pose_driver,
    properties,
    property_groups,
    references,
    undeformed,
    upstream_proxy,
)
from .layout import Layout
from .subscribers import notify, subscribers

ATTRIBUTE, NORMALS_ATTRIBUTE = f"{node_group.OWN}points", f"{node_group.OWN}normals"


def ensure(obj: bpy.types.Object, now: Layout, in_buffer: bool, normals: str, in_renders: bool) -> Layout:
    """Makes the attribute or the point buffer for an object's points, and has Sinew's modifier read it.
    Returns the layout after that.

    now         its layout
    normals     the domain of the normals that are stored with them, POINT or CORNER; empty for none
    in_renders  normals are given in renders, too

    Raises SinewError where the modifiers before Sinew cannot be evaluated separately.
    """
    nodes = obj.modifiers[now.sinew]
    if in_buffer:
        if properties.of(obj).storage.attribute:
            remove_attributes(obj)
        made = upstream_proxy.ensure(obj, now)
        kind, inputs = node_group.POINT_BUFFER, {"Points": point_buffer.ensure(obj), "Upstream": made}
    else:
        upstream_proxy.remove(obj)
        point_buffer.remove(obj)
        attribute = _ensure_attribute(obj)
        _ensure_normals_attribute(obj.data, normals_name(attribute), normals)
        kind, inputs = node_group.ATTRIBUTE, {"Points": attribute}
        if normals:
            inputs[node_group.NORMALS] = normals_name(attribute)
    if normals:
        inputs[node_group.IN_RENDERS] = in_renders
    now, more = undeformed.ensure(obj, now)
    inputs |= more
    made_by_features = notify(subscribers.node_group, obj)
    group = next(filter(None, made_by_features), None) or node_group.get_or_make(kind, normals)
    if nodes.node_group != group:
        # The driver can be on an input that the other group does not have.
        pose_driver.remove(obj)
        references.note(obj)
        nodes.node_group = group
        node_group.remove_unused()
    node_group.set_inputs(nodes, inputs)
    return now


def _ensure_attribute(obj: bpy.types.Object) -> str:
    """Returns its name."""
    storage, mesh = properties.of(obj).storage, obj.data
    if not storage.attribute:
        storage.attribute = _free_attribute_name(mesh)
    if not mesh_io.has_vectors(mesh, storage.attribute, "POINT"):
        # Shown by an evaluation in which Sinew gave no points.
        rest = mesh_io.read_points(mesh)
        mesh_io.write_vectors(mesh, storage.attribute, _marked(rest, rest))
    return storage.attribute


def normals_name(attribute: str) -> str:
    """Returns the name of the attribute with the normals that belong to the points of another."""
    return attribute.replace(ATTRIBUTE, NORMALS_ATTRIBUTE)


def _ensure_normals_attribute(mesh: bpy.types.Mesh, name: str, domain: str) -> None:
    """Fills the attribute with zeros, which mean that Sinew gave no normals."""
    if not domain:
        mesh_io.remove_attribute(mesh, name)
    elif not mesh_io.has_vectors(mesh, name, domain):
        none = np.zeros((mesh_io.domain_size(mesh, domain), 3), dtype=np.float32)
        mesh_io.write_vectors(mesh, name, none, domain)


def write(obj: bpy.types.Object, points: np.ndarray, rest: np.ndarray, normals: np.ndarray) -> None:
    """Stores float32 [vertices, 3], object space, in the point buffer, and has Blender evaluate it.

    rest     float32 [vertices, 3], the rest points
    normals  float32 [vertices or corners, 3], stored behind the points; or [0, 3]
    """
    stored = _marked(points, rest)
    if len(normals):
        stored = np.concatenate((stored, normals))
    point_buffer.write(properties.of(obj).storage.point_buffer, stored)


def set_rest_points(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, rest: np.ndarray, normals: int, anew: bool
) -> None:
    """Stores the rest points in the point buffer, which an evaluation then moves: where their number differs,
    or if `anew`.

    normals  the number of normals behind them; they are 0, which means that Sinew gave none
    """
    if anew or not are_written(obj, depsgraph, len(rest) + normals, are_moved=True):
        write(obj, rest, rest, np.zeros((normals, 3), dtype=np.float32))


def mark_as_written(shown: np.ndarray, rest: np.ndarray) -> None:
    """Marks points as written by Sinew, in place; see _marked()."""
    if np.array_equal(shown[:1], rest[:1]) and np.array_equal(shown, rest):
        shown[:] = _marked(shown, rest)


def are_written(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, count: int, are_moved: bool = False
) -> bool:
    """Whether the point buffer has `count` points and normals, and this evaluation has the same.

    are_moved  the evaluation itself moves the points, so only the number is compared
    """
    buffer = properties.of(obj).storage.point_buffer
    if buffer is None or len(buffer.data.vertices) != count:
        return False
    return point_buffer.is_in(depsgraph, buffer, with_points=not are_moved)


def are_applied(obj: bpy.types.Object, rest: np.ndarray | None, shown: np.ndarray | None) -> bool:
    """Whether a mesh without Sinew's modifier has the deformed shape, because the modifier was applied; the
    attribute is then gone, too.

    rest, shown  float32 [vertices, 3], the points as bound, and the last shape; None where unknown
    """
    settings, own = properties.of(obj), mesh_io.read_points(obj.data)
    if not settings.replaces_modifiers:
        return False
    if settings.storage.point_buffer is None:
        name = settings.storage.attribute
        is_gone = bool(name) and mesh_io.find_attribute(obj.data, name) is None
        return is_gone and (shown is None or np.array_equal(shown, own))
    if rest is None or shown is None or rest.shape != own.shape or np.array_equal(rest, own):
        return False
    return np.array_equal(_marked(shown, rest), own)


def _marked(points: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Returns the points. If they equal the rest points exactly, one of them is changed by a rounding error.
    So applying Sinew's modifier can be told from deleting it, and points written by Sinew from those of the
    mesh."""
    if not np.array_equal(points, rest):
        return points
    other = points.copy()
    other[:1] = np.nextafter(other[:1], np.inf)
    return other


def remove_point_attributes(obj: bpy.types.Object) -> None:
    """Removes them from the mesh while Sinew is off: a subdivision would interpolate them for each of its
    vertices, and exports would contain them."""
    if not obj.data.is_editmode:
        remove_attributes(obj)


def remove(obj: bpy.types.Object) -> None:
    """Removes everything that stores points."""
    upstream_proxy.remove(obj)
    point_buffer.remove(obj)
    remove_point_attributes(obj)


def clear_references(obj: bpy.types.Object) -> None:
    """Clears all references to what Sinew made (references.py); ensure() makes them again."""
    now = layout.read(obj)
    nodes, mark = obj.modifiers.get(now.sinew), obj.modifiers.get(now.mark)
    pose_driver.remove(obj)
    _forget_helpers(obj)
    if nodes is not None and nodes.node_group is not None:
        node_group.forget_helpers(nodes)
        nodes.node_group = None
    if mark is not None:
        mark.node_group = None


def references_of(obj: bpy.types.Object) -> list[int]:
    """Returns the session_uid of all that it refers to because of Sinew, 0 for none."""
    now, storage = layout.read(obj), properties.of(obj).storage
    groups = [obj.modifiers[name].node_group for name in (now.sinew, now.mark) if name]
    found = (storage.point_buffer, storage.upstream_proxy, *groups, *pose_driver.targets_of(obj))
    return [0 if each is None else each.session_uid for each in found]


def clear_references_to_itself(obj: bpy.types.Object) -> None:
    """Called after undo and redo, which read an object that changed into new memory. Where a deleted object
    was in that memory when the step was made, Blender (4.2 to 5.2) has pointers to it point to the object
    itself: it remaps these before it links the others, in its function
    read_libblock_undo_restore_at_old_address(). Sinew would write its points into the artist's mesh."""
    if property_groups.clear_pointers(properties.of(obj), obj):
        clear_references(obj)


def _forget_helpers(obj: bpy.types.Object) -> None:
    storage = properties.of(obj).storage
    storage.point_buffer = storage.upstream_proxy = None


def unshare(objects: list[bpy.types.Object]) -> None:
    """Makes sure that no two objects share a point buffer or an upstream proxy, as copies of an object do:
    ensure() gives each its own."""
    taken: set[str] = set()
    for obj in objects:
        storage = properties.of(obj).storage
        used = {each.name_full for each in (storage.point_buffer, storage.upstream_proxy) if each is not None}
        if used & taken and obj.is_editable:
            _forget_helpers(obj)
        taken |= used


def _free_attribute_name(mesh: bpy.types.Mesh) -> str:
    name, number = ATTRIBUTE, 0
    while any(mesh_io.find_attribute(mesh, each) is not None for each in (name, normals_name(name))):
        number += 1
        name = f"{ATTRIBUTE}.{number:03d}"
    return name


def remove_attributes(obj: bpy.types.Object) -> None:
    """Removes all of Sinew's attributes from the mesh: one that was copied can have several."""
    mesh, storage = obj.data, properties.of(obj).storage
    for name in [each.name for each in mesh.attributes] if mesh.is_editable else ():
        if name.startswith(node_group.OWN):
            mesh_io.remove_attribute(mesh, name)
    if storage.attribute:
        storage.attribute = ""
