# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares a mesh with its copy, and keeps the copy's points as those of the mesh."""

from collections.abc import Iterator

import bpy
import numpy as np

from ..skinning.arrays import memory_of
from . import mesh_io

_SETTINGS = ("texspace_location", "texspace_size", "use_auto_texspace", "has_custom_normals")
_KEY_SETTINGS = ("name", "mute", "vertex_group", "slider_min", "slider_max", "interpolation")
# What an attribute's values are called, how many numbers each has, and of which kind they are in memory.
_VALUES = {
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.uint8),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
    "INT16_2D": ("value", 2, np.int16),
    "INT32_2D": ("value", 2, np.int32),
}


def are_alike(mesh: bpy.types.Mesh, copy: bpy.types.Mesh) -> bool:
    """Whether modifiers make the same of both: their points, faces, attributes, weights, materials and shape
    keys, but for the values of the keys. Neither is in edit mode."""
    if not all(mine == its for mine, its in zip(_facts(mesh), _facts(copy), strict=True)):
        return False
    weights = mesh_io.read_group_weights(mesh)
    return mesh_io.read_group_weights(copy, weights).equals(weights) and all(
        np.array_equal(_bits(mine), _bits(its))
        for mine, its in zip(_arrays(mesh), _arrays(copy), strict=True)
    )


def is_good_copy(mesh: bpy.types.Mesh, copy: bpy.types.Mesh) -> bool:
    """The same for a copy that was just made of the mesh. Only the first one of each mesh is compared."""
    if mesh.session_uid not in _copied_well and are_alike(mesh, copy):
        _copied_well.add(mesh.session_uid)
    return mesh.session_uid in _copied_well


# The session_uid of meshes that equalled a copy.
_copied_well: set[int] = set()


def _facts(mesh: bpy.types.Mesh) -> Iterator[object]:
    """What is compared first: all that says how many arrays there are, and how long they are."""
    yield len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)
    yield [(each.name, each.data_type, each.domain) for each in mesh.attributes]
    yield list(mesh.materials)
    yield [
        tuple(value) if hasattr(value, "__len__") else value
        for value in map(lambda name: getattr(mesh, name), _SETTINGS)
    ]
    keys = mesh.shape_keys
    yield keys is not None and keys.use_relative
    yield [
        (*(getattr(key, name) for name in _KEY_SETTINGS), key.relative_key.name)
        for key in (() if keys is None else keys.key_blocks)
    ]


def _arrays(mesh: bpy.types.Mesh) -> Iterator[np.ndarray]:
    """Blender's own, where they can be had without a copy."""
    yield mesh_io.read_face_offsets(mesh)
    for attribute in mesh.attributes:
        yield _values_of(attribute)
    if mesh.has_custom_normals and mesh_io.find_attribute(mesh, mesh_io.CUSTOM_NORMALS) is None:
        yield mesh_io.corner_normals(mesh)
    for key in () if mesh.shape_keys is None else mesh.shape_keys.key_blocks:
        memory = memory_of(key.points, 3)
        yield mesh_io.read_key_points(key) if memory is None else memory


def _values_of(attribute: bpy.types.Attribute) -> np.ndarray:
    name, width, kind = _VALUES.get(attribute.data_type, ("value", 0, None))
    memory = memory_of(attribute.data, width, kind) if width else None
    return np.array([getattr(each, name) for each in attribute.data]) if memory is None else memory


def _bits(values: np.ndarray) -> np.ndarray:
    """Returns floats as whole numbers, by which a number equals itself that is not finite."""
    return values.view(np.int32) if values.dtype == np.float32 else values


def write_points(mesh: bpy.types.Mesh, copy: bpy.types.Mesh) -> None:
    """Gives the copy the points of the mesh and of its shape keys, where it has as many."""
    keys = [() if each.shape_keys is None else each.shape_keys.key_blocks for each in (mesh, copy)]
    if len(mesh.vertices) != len(copy.vertices) or len(keys[0]) != len(keys[1]):
        return
    mesh_io.attribute_to_write(copy, mesh_io.POSITION).data.foreach_set(
        "vector", mesh_io.read_points(mesh).ravel()
    )
    for mine, its in zip(*keys, strict=True):
        its.points.foreach_set("co", mesh_io.read_key_points(mine).ravel())
    copy.update_tag()
