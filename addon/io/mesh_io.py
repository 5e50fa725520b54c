# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads rest points, surface, shape keys and weights from a mesh; writes deformed points into an
attribute."""

import ctypes
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from operator import itemgetter

import bmesh
import bpy
import numpy as np
import sinew

from ..base.errors import SinewError
from ..skinning import sdef
from ..skinning.arrays import are_equal, memory_of, read
from ..skinning.influences import GroupWeights
from ..skinning.shading import Shading
from ..skinning.shape_keys import ShapeKeys
from ..skinning.stage_mesh import Topology
from ..skinning.surface import Surface, coincident_vertices
from . import mesh_memory

# The attribute with a mesh's vertices: as a whole it is read and written a hundred times as fast as the
# vertices' "co".
POSITION = "position"
SHARP_EDGES, SHARP_FACES, CUSTOM_NORMALS = "sharp_edge", "sharp_face", "custom_normal"
_OFFSET_BYTES = np.dtype(np.int32).itemsize


def find_attribute(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    """Returns the attribute to read; None where the mesh has none of that name. To write, use
    attribute_to_write()."""
    index = mesh.attributes.find(name)
    return None if index < 0 else mesh.attributes[index]


def attribute_to_write(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    """Returns the attribute, with an array that only this mesh has; None where it has none of that name.

    Blender expects any attribute that is looked up by name to be written, and copies an array that the mesh
    shares with the evaluated mesh or with undo steps. Each undo then lists the mesh as changed.
    """
    return mesh.attributes.get(name)


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """int32 [corners], the vertex of each."""
    return read(mesh.loops, "vertex_index", kind=np.int32)


def corner_normals(mesh: bpy.types.Mesh) -> np.ndarray:
    """float32 [corners, 3], object space."""
    return read(mesh.corner_normals, "vector", 3)


# The functions that take `known`, what was read before, return it itself where it is still the same. They
# compare it in place: copying takes several times as long.


def _values(
    attribute: bpy.types.Attribute, name: str, width: int, kind: type, known: np.ndarray | None
) -> np.ndarray:
    """Returns all values of an attribute; a copy, or `known`."""
    memory = memory_of(attribute.data, width, kind)
    return read(attribute.data, name, width, kind) if memory is None else _kept(memory, known)


def _kept(memory: np.ndarray, known: np.ndarray | None) -> np.ndarray:
    return known if known is not None and are_equal(memory, known) else memory.copy()


def read_points(mesh: bpy.types.Mesh, known: np.ndarray | None = None) -> np.ndarray:
    """Returns vertex positions in object space, float32 [vertices, 3]; a copy, or `known`."""
    # In edit mode a mesh has no attributes, and without vertices it may have none.
    attribute = None if mesh.is_editmode else find_attribute(mesh, POSITION)
    if attribute is not None and len(attribute.data) == len(mesh.vertices):
        return _values(attribute, "vector", 3, np.float32, known)
    return read(mesh.vertices, "co", 3)


def read_key_points(block: bpy.types.ShapeKey) -> np.ndarray:
    """Returns float32 [vertices, 3], as stored."""
    return read(block.points, "co", 3)


def read_sdef_keys(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """Returns float32 [4, vertices, 3]: the basis, then C, R0 and R1 of the method sdef; None without these
    keys."""
    keys = mesh.shape_keys
    blocks = [] if keys is None else [keys.key_blocks.get(name) for name in sdef.KEYS]
    if not blocks or None in blocks:
        return None
    points = np.array([read_key_points(block) for block in (keys.reference_key, *blocks)])
    # In edit mode the mesh can have other vertices than its keys.
    return points if points.shape[1] == len(mesh.vertices) else None


def read_triangles(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns int32 [triangles, 3]: the vertices of each."""
    mesh.calc_loop_triangles()
    return read(mesh.loop_triangles, "vertices", 3, np.int32)


def read_surface(mesh: bpy.types.Mesh) -> Surface:
    triangles, edges = read_triangles(mesh), read(mesh.edges, "vertices", 2, np.int32)
    return Surface(len(mesh.vertices), triangles, edges, coincident_vertices(read_points(mesh)))


def read_topology(mesh: bpy.types.Mesh, known: Topology | None = None) -> Topology:
    offsets, corners, edges = (
        (None, None, None) if known is None else (known.face_offsets, known.corner_vertices, known.edges)
    )
    # Reading whole attributes takes a hundredth of the time.
    of_corners, of_edges = (
        None if mesh.is_editmode else find_attribute(mesh, name) for name in (".corner_vert", ".edge_verts")
    )
    if of_corners is not None and of_edges is not None:
        corners = _values(of_corners, "value", 1, np.int32, corners)
        edges = _values(of_edges, "value", 2, np.int32, edges)
    else:
        corners, edges = corner_vertices(mesh), read(mesh.edges, "vertices", 2, np.int32)
    return Topology(read_face_offsets(mesh, offsets), corners, edges)


def read_face_offsets(mesh: bpy.types.Mesh, known: np.ndarray | None = None) -> np.ndarray:
    """Returns int32 [faces + 1]: the first corner of each face, then the end; a copy, or `known`."""
    faces, corners = mesh.polygons, len(mesh.loops)
    count = len(faces)
    # A face is its offset in Blender's array (4.0 to 5.3). "loop_start" takes a hundred times as long.
    first = faces[0].as_pointer() if count else 0
    if count and faces[count - 1].as_pointer() - first == (count - 1) * _OFFSET_BYTES:
        offsets = np.ctypeslib.as_array((ctypes.c_int32 * (count + 1)).from_address(first))
        if offsets[0] == 0 and offsets[count] == corners:
            return _kept(offsets, known)
    return np.append(read(faces, "loop_start", kind=np.int32), np.int32(corners))


def read_shading(mesh: bpy.types.Mesh, known: Shading | None = None) -> Shading:
    """Returns what the mesh's normals depend on, apart from its points."""
    before = known or Shading()
    return Shading(
        _read_flags(mesh, SHARP_EDGES, mesh.edges, "use_edge_sharp", True, before.sharp_edges),
        _read_flags(mesh, SHARP_FACES, mesh.polygons, "use_smooth", False, before.sharp_faces),
        _read_custom_normals(mesh, before.custom),
    )


def _read_flags(
    mesh: bpy.types.Mesh,
    name: str,
    elements: bpy.types.bpy_prop_collection,
    property_name: str,
    shown_as: bool,
    known: np.ndarray | None,
) -> np.ndarray | None:
    """Returns bool [elements]; None where no flag is set.

    shown_as  the value of the elements' property that means a set flag; read where the mesh has no attributes
    """
    if mesh.is_editmode:
        flags = read(elements, property_name, kind=bool) == shown_as
    else:
        attribute = find_attribute(mesh, name)
        if attribute is None or attribute.data_type != "BOOLEAN":
            return None
        flags = _values(attribute, "value", 1, bool, known)
    return flags if flags.any() and len(flags) == len(elements) else None


def _read_custom_normals(mesh: bpy.types.Mesh, known: np.ndarray | None) -> np.ndarray | None:
    """Returns int16 [corners, 2], as Blender stores them relative to the computed normals; None where there
    are none. Blender 4.5 and later."""
    attribute = None if mesh.is_editmode else find_attribute(mesh, CUSTOM_NORMALS)
    if attribute is None or attribute.data_type != "INT16_2D" or attribute.domain != "CORNER":
        return None
    memory = memory_of(attribute.data, 2, np.int16)
    if memory is None:
        return read(attribute.data, "value", 2, np.int32).astype(np.int16)
    return _kept(memory, known)


def restore_custom_normals(mesh: bpy.types.Mesh, custom: np.ndarray | None) -> None:
    """Removes Sinew's normals from a mesh that was made from an evaluated one, and restores those of the
    original mesh.

    custom  int16 [corners, 2], as Shading.custom
    """
    attribute = find_attribute(mesh, CUSTOM_NORMALS)
    if attribute is None or attribute.data_type != "FLOAT_VECTOR":
        return
    remove_attribute(mesh, CUSTOM_NORMALS)
    if custom is not None and len(custom) == len(mesh.loops):
        made = add_attribute(mesh, CUSTOM_NORMALS, "INT16_2D", "CORNER")
        made.data.foreach_set("value", custom.astype(np.int32).ravel())
    mesh.update()


def read_group_weights(mesh: bpy.types.Mesh, known: GroupWeights | None = None) -> GroupWeights:
    """Returns all entries of all vertices, in stored order."""
    address = mesh_memory.address_of_groups(mesh)
    if address is None:
        return _read_groups_of(mesh.vertices)
    if address == 0:
        return GroupWeights.none(len(mesh.vertices))
    before = None if known is None else (known.counts, known.groups, known.weights)
    return GroupWeights(*sinew.weights_in_memory(address, len(mesh.vertices), before))


def read_edited_weights(edited: bmesh.types.BMesh) -> GroupWeights:
    layer = edited.verts.layers.deform.active
    if layer is None:
        return GroupWeights.none(len(edited.verts))
    vertices = list(map(itemgetter(layer), edited.verts))
    counts = np.fromiter(map(len, vertices), np.int32, len(vertices))
    entries = int(counts.sum())
    groups = chain.from_iterable(map(bmesh.types.BMDeformVert.keys, vertices))
    weights = chain.from_iterable(map(bmesh.types.BMDeformVert.values, vertices))
    return GroupWeights(
        counts, np.fromiter(groups, np.int32, entries), np.fromiter(weights, np.float32, entries)
    )


def _read_groups_of(vertices: bpy.types.bpy_prop_collection) -> GroupWeights:
    of_each = [[(entry.group, entry.weight) for entry in vertex.groups] for vertex in vertices]
    counts = np.fromiter(map(len, of_each), np.int32, len(of_each))
    entries = np.array([entry for entries in of_each for entry in entries], dtype=np.float64).reshape(-1, 2)
    return GroupWeights(counts, entries[:, 0].astype(np.int32), entries[:, 1].astype(np.float32))


def write_group_weights(obj: bpy.types.Object, rows: Mapping[int, Mapping[int, float]]) -> None:
    """Gives vertices other weights, also in edit mode. Entries that stay keep their position in the stored
    order.

    rows  for each vertex that changes, by its index: its weight in each group, by the group's index
    """
    if obj.mode == "EDIT":
        edited = bmesh.from_edit_mesh(obj.data)
        layer = edited.verts.layers.deform.verify()
        edited.verts.ensure_lookup_table()
        for vertex, row in rows.items():
            own = edited.verts[vertex][layer]
            for group in [group for group in own.keys() if group not in row]:  # noqa: SIM118, no dict
                del own[group]
            for group, weight in row.items():
                own[group] = weight
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
        return
    groups = list(obj.vertex_groups)
    for vertex, row in rows.items():
        for group in [each.group for each in obj.data.vertices[vertex].groups]:
            if group not in row and group < len(groups):
                groups[group].remove([vertex])
        for group, weight in row.items():
            groups[group].add([vertex], weight, "REPLACE")
    obj.data.update_tag()


def read_shape_keys(
    obj: bpy.types.Object, weights: GroupWeights, known: ShapeKeys | None = None
) -> ShapeKeys | None:
    """Returns the relative shape keys of a mesh object, None where it has none. Those that are the same are
    the very arrays of `known`.

    Raises SinewError for absolute keys.
    """
    keys = obj.data.shape_keys
    if keys is None:
        return None
    if not keys.use_relative:
        raise SinewError(
            f"{obj.name}: its shape keys are absolute, which Sinew does not mix; switch them to Relative"
        )
    points = {}
    for block in keys.key_blocks:
        memory = memory_of(block.points, 3)
        points[block.name] = read_key_points(block) if memory is None else memory
    basis, names = keys.reference_key, obj.vertex_groups.keys()
    before = known.deltas if known is not None and known.names == tuple(points) else [None] * len(points)
    moves: list[np.ndarray | None] = []
    # One for all keys: the memory of new arrays takes longer than the arithmetic.
    move = np.empty_like(points[basis.name])
    for block, its_known in zip(keys.key_blocks, before, strict=True):
        if block == basis:
            moves.append(None)
            continue
        np.subtract(points[block.name], points[block.relative_key.name], out=move)
        mask = _mask_of(block, names, weights)
        if mask is not None:
            np.multiply(mask, move, out=move)
        moves.append(_kept(move, its_known))
    return ShapeKeys(tuple(points), _kept(points[basis.name], known and known.basis), tuple(moves))


def _mask_of(block: bpy.types.ShapeKey, group_names: list[str], weights: GroupWeights) -> np.ndarray | None:
    """Returns float32 [vertices, 1], the weights of the shape key's vertex group; None for all of it."""
    name = block.vertex_group
    return weights.of_group(group_names.index(name))[:, None] if name in group_names else None


def read_key_values(evaluated_keys: bpy.types.Key) -> np.ndarray:
    """Returns float32 [keys]: the value of each shape key at this evaluation; 0 where it is muted."""
    blocks = evaluated_keys.key_blocks
    values = read(blocks, "value")
    values[read(blocks, "mute", kind=bool)] = 0.0
    return values


def read_pinned_points(
    keys: bpy.types.Key, active: int, group_names: list[str], weights: GroupWeights
) -> np.ndarray:
    """Returns float32 [vertices, 3]: the pinned shape key, masked by its vertex group; the basis where it is
    muted.

    active       the index of the shape key
    group_names  of the weights
    """
    basis = keys.reference_key
    block = keys.key_blocks[active] if 0 <= active < len(keys.key_blocks) else basis
    if block.mute:
        return read_key_points(basis)
    mask = _mask_of(block, group_names, weights)
    if mask is None:
        return read_key_points(block)
    points = read_key_points(basis)
    return points + mask * (read_key_points(block) - points)


def write_vectors(mesh: bpy.types.Mesh, name: str, vectors: np.ndarray, domain: str = "POINT") -> None:
    """Stores float32 [vertices or corners, 3] in the attribute `name`, made where it is missing."""
    attribute = attribute_to_write(mesh, name)
    if not _is_of_vectors(attribute, domain):
        if attribute is not None:
            mesh.attributes.remove(attribute)
        attribute = add_attribute(mesh, name, "FLOAT_VECTOR", domain)
    attribute.data.foreach_set("vector", vectors.ravel())


def write_values(mesh: bpy.types.Mesh, name: str, values: np.ndarray) -> None:
    """Stores float32 [vertices] in the attribute `name`, made anew."""
    remove_attribute(mesh, name)
    add_attribute(mesh, name, "FLOAT", "POINT").data.foreach_set("value", values)


def add_attribute(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str) -> bpy.types.Attribute:
    """Adds an attribute. Blender would make it active; here the artist's choices stay."""
    with _same_choices(mesh, name):
        return mesh.attributes.new(name, data_type, domain)


@contextmanager
def _same_choices(mesh: bpy.types.Mesh, name: str) -> Iterator[None]:
    """Keeps which attributes are active, and which colours are rendered, while `name` is added or removed."""
    choices = ("active_index", "active_color_name", "default_color_name")
    before = [getattr(mesh.attributes, choice) for choice in choices]
    yield
    for choice, value in zip(choices, before, strict=True):
        if value != name and getattr(mesh.attributes, choice) != value:
            setattr(mesh.attributes, choice, value)


def has_vectors(mesh: bpy.types.Mesh, name: str, domain: str) -> bool:
    return _is_of_vectors(find_attribute(mesh, name), domain)


def _is_of_vectors(attribute: bpy.types.Attribute | None, domain: str) -> bool:
    return attribute is not None and attribute.domain == domain and attribute.data_type == "FLOAT_VECTOR"


def domain_size(mesh: bpy.types.Mesh, domain: str) -> int:
    """The number of vertices or corners."""
    return len(mesh.vertices if domain == "POINT" else mesh.loops)


def vectors_in(evaluated_mesh: bpy.types.Mesh, name: str, domain: str = "POINT") -> np.ndarray | None:
    """Returns the memory of the evaluated mesh's attribute `name` in the domain, float32 [vertices or
    corners, 3], which Blender then does not share with another mesh. Valid until the mesh is evaluated again
    or changed.

    None for a mesh without vertices, or without such an attribute of vectors, and where the memory is not
    contiguous.
    """
    attribute = attribute_to_write(evaluated_mesh, name)
    if not _is_of_vectors(attribute, domain):
        return None
    is_whole = len(attribute.data) == domain_size(evaluated_mesh, domain)
    return memory_of(attribute.data, 3, np.float32) if is_whole else None


def remove_attribute(mesh: bpy.types.Mesh, name: str) -> None:
    attribute = find_attribute(mesh, name)
    if attribute is not None:
        with _same_choices(mesh, name):
            mesh.attributes.remove(attribute)
