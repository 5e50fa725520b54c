# SPDX-License-Identifier: GPL-3.0-or-later
"""An object in no scene whose vertices are the deformed points of another object, followed by its normals
where Sinew gives them.

It is used where an attribute of the mesh is not possible: the mesh is linked from another file, shared, or
has other vertices than what is deformed, or the points are written after the update. Within Blender's
evaluation Sinew writes to its evaluated copy, and the original keeps the rest points.
"""

import bpy
import numpy as np

from ..io import mesh_io
from . import properties, references


def ensure(obj: bpy.types.Object) -> bpy.types.Object:
    storage = properties.of(obj).storage
    if storage.point_buffer is None or storage.point_buffer.library is not None:
        references.note(obj)
        name = f"{obj.name} Sinew points"
        storage.point_buffer = bpy.data.objects.new(name, bpy.data.meshes.new(name))
        properties.of(storage.point_buffer).identity.is_helper = True
    return storage.point_buffer


def write(point_buffer: bpy.types.Object, points: np.ndarray) -> None:
    """Stores float32 [vertices, 3]."""
    mesh = point_buffer.data
    if len(mesh.vertices) != len(points):
        mesh.clear_geometry()
        mesh.vertices.add(len(points))
    if len(points):
        mesh_io.attribute_to_write(mesh, mesh_io.POSITION).data.foreach_set("vector", points.ravel())
    mesh.update_tag()


def is_in(depsgraph: bpy.types.Depsgraph, point_buffer: bpy.types.Object, with_points: bool) -> bool:
    """Whether an evaluation that contains the point buffer has its current content. Blender (4.2 to 5.2) does
    not evaluate again a buffer that was deleted and that undo restored, in a view layer that is not shown:
    its content is then that of another step.

    with_points  compares the points, not only their number
    """
    evaluated = point_buffer.evaluated_get(depsgraph)
    # At the address of a deleted object, Blender returns what was evaluated for that.
    if not (isinstance(evaluated, bpy.types.Object) and evaluated.type == "MESH" and evaluated.is_evaluated):
        return True
    mesh, own = evaluated.data, point_buffer.data
    if len(mesh.vertices) != len(own.vertices):
        return False
    return not with_points or np.array_equal(
        mesh_io.read_points(mesh), mesh_io.read_points(own), equal_nan=True
    )


def remove(obj: bpy.types.Object) -> None:
    storage = properties.of(obj).storage
    point_buffer, storage.point_buffer = storage.point_buffer, None
    if point_buffer is not None and point_buffer.library is None:
        # Also removes the object that uses it.
        bpy.data.meshes.remove(point_buffer.data)
