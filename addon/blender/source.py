# SPDX-License-Identifier: GPL-3.0-or-later
"""What comes to an object's first Armature modifier: rest points and weights, as they are read from its mesh,
or from what the modifiers in front make of it."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..core.influences import GroupWeights
from ..core.shape_keys import ShapeKeys
from . import front, mesh_io, properties
from .changes import Changes


@dataclass
class Source:
    """Read once, and again when it may be out of date.

    points            float32 [vertices, 3], object space, without shape keys
    from_front        read from what the modifiers in front make of the mesh
    key_values        of the shape keys that are mixed in mixed_points
    known_key_values  of those when changes were looked at last
    """

    group_names: list[str]
    weights: GroupWeights
    points: np.ndarray
    shape_keys: ShapeKeys | None
    from_front: bool = False
    key_values: np.ndarray | None = None
    known_key_values: np.ndarray | None = None
    mixed_points: np.ndarray | None = None

    def equals_but_for_points(self, other: Source) -> bool:
        return self.group_names == other.group_names and self.weights.equals(other.weights)


def is_ready(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, was_on: bool = True) -> bool:
    """False as long as Blender has not evaluated what stands in front: it was just made, or Sinew was off and
    nothing needed it."""
    if properties.of(obj).front is None:
        return True
    return was_on and front.evaluated_mesh(obj, depsgraph) is not None


def read(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Source:
    """Requires is_ready."""
    names = [group.name for group in obj.vertex_groups]
    if properties.of(obj).front is not None:
        mesh = front.evaluated_mesh(obj, depsgraph)
        points = mesh_io.read_points(mesh)
        return Source(names, mesh_io.read_group_weights(mesh), points, None, from_front=True)
    weights = mesh_io.read_group_weights(obj.data)
    points = mesh_io.read_points(obj.data)
    return Source(names, weights, points, mesh_io.read_shape_keys(obj, weights))


def has_changed(
    obj: bpy.types.Object,
    source: Source,
    depsgraph: bpy.types.Depsgraph,
    changes: Changes,
    touched: bool,
) -> bool:
    """Whether points, weights, groups or shape keys may differ from those read, but for key values and for
    what moves points in front.

    touched  the object itself may have changed
    """
    if touched and [g.name for g in obj.vertex_groups] != source.group_names:
        return True
    helper = properties.of(obj).front
    if (helper is not None) != source.from_front:
        return True
    if helper is not None:
        mesh = front.evaluated_mesh(obj, depsgraph)
        evaluated = helper.session_uid in changes.objects
        if len(mesh.vertices) != len(source.points):
            return True
        return evaluated and (not changes.frame or front.changes_weights(obj))
    mesh, keys, known = obj.data, obj.data.shape_keys, source.shape_keys
    if len(mesh.vertices) != len(source.points) or (keys is None) != (known is None):
        return True
    if keys is not None and tuple(block.name for block in keys.key_blocks) != known.names:
        return True
    if mesh.session_uid not in changes.meshes:
        return False
    # An object that an animation moves dirties its mesh, and weights take long to read.
    if changes.frame and obj.session_uid in changes.moved | changes.gated:
        return False
    if keys is None:
        return True
    # Shape keys dirty the mesh whenever one moves, and weights do not change by that: reading them again on
    # every step of a slider or every frame of an animation would cost more than the frame.
    if changes.frame and keys.animation_data is not None:
        return False
    values = mesh_io.read_key_values(keys.evaluated_get(depsgraph))
    return np.array_equal(values, source.known_key_values)


def rest_points(obj: bpy.types.Object, source: Source, depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """float32 [vertices, 3] at this evaluation; the same array as before where nothing changed.

    Requires is_ready.
    """
    if properties.of(obj).front is not None:
        points = mesh_io.read_points(front.evaluated_mesh(obj, depsgraph))
        if not np.array_equal(points, source.points):
            source.points = points
        return source.points
    return keyed_points(obj, obj.data.evaluated_get(depsgraph), source)


def keyed_points(obj: bpy.types.Object, evaluated_mesh: bpy.types.Mesh, source: Source) -> np.ndarray:
    """The same for a source that is the mesh itself."""
    if source.shape_keys is None:
        return source.points
    values = mesh_io.read_key_values(evaluated_mesh.shape_keys)
    if source.mixed_points is None or not np.array_equal(values, source.key_values):
        source.key_values = values
        source.mixed_points = source.shape_keys.mix(values)
    if obj.show_only_shape_key:
        pinned = mesh_io.read_pinned_points(obj)
        if not np.array_equal(pinned, source.mixed_points):
            source.mixed_points = pinned
            # Whatever the values are, leaving the pin mixes again.
            source.key_values = np.full_like(values, np.nan)
    return source.mixed_points
