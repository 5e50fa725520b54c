# SPDX-License-Identifier: GPL-3.0-or-later
"""An object in no scene whose vertices are the deformed points of another, then its normals where Sinew gives
these.

It serves where an attribute of the mesh can not: the mesh is linked from another file, others use it, it has
other vertices than what is deformed, or the points are written after the update. Within Blender's evaluation
its evaluated copy is written, and it keeps the rest points.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..io import mesh_io
from . import properties, references


def ensure(obj: bpy.types.Object) -> bpy.types.Object:
    settings = properties.of(obj)
    if settings.point_buffer is None or settings.point_buffer.library is not None:
        references.note(obj)
        name = f"{obj.name} Sinew points"
        settings.point_buffer = bpy.data.objects.new(name, bpy.data.meshes.new(name))
        properties.of(settings.point_buffer).helper = True
    return settings.point_buffer


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
    """Whether an evaluation that has the point buffer has it as it is. One that was deleted and that undo
    brought back, in a view layer that is not shown, Blender (4.2 to 5.2) leaves as it was evaluated last:
    with what another step had.

    with_points  not only as many
    """
    evaluated = point_buffer.evaluated_get(depsgraph)
    # What is at the address of something that was deleted has Blender give out that one.
    if not (isinstance(evaluated, bpy.types.Object) and evaluated.type == "MESH" and evaluated.is_evaluated):
        return True
    mesh, own = evaluated.data, point_buffer.data
    if len(mesh.vertices) != len(own.vertices):
        return False
    return not with_points or np.array_equal(
        mesh_io.read_points(mesh), mesh_io.read_points(own), equal_nan=True
    )


def remove(obj: bpy.types.Object) -> None:
    settings = properties.of(obj)
    point_buffer, settings.point_buffer = settings.point_buffer, None
    if point_buffer is not None and point_buffer.library is None:
        # Takes the object that uses it along.
        bpy.data.meshes.remove(point_buffer.data)
