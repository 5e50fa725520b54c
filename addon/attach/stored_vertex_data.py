# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores methods' vertex data in the mesh that it belongs to, so that it need not be computed again when a
saved file is opened. The key is a hash of what the data was made from: a changed mesh finds no data.

It is a property of the mesh, not an attribute: downstream modifiers would interpolate that in every frame.
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy
import numpy as np

NAME = "sinew_vertex_data"


class SinewVertexData(bpy.types.PropertyGroup):
    """Bytes of float32 [vertices, n] by their key, "KEY n"."""


def read(mesh: bpy.types.Mesh) -> dict[str, np.ndarray]:
    """Returns float32 [vertices, n] by its key; copies."""
    if not mesh.is_property_set(NAME):
        return {}
    found = {}
    for name, content in getattr(mesh, NAME).items():
        key, _space, width = name.partition(" ")
        if (
            isinstance(content, bytes)
            and width.isdigit()
            and int(width)
            and len(content) % (4 * int(width)) == 0
        ):
            found[key] = np.frombuffer(content, dtype=np.float32).reshape(-1, int(width))
    return found


def write(mesh: bpy.types.Mesh, made: Mapping[str, np.ndarray]) -> None:
    """Replaces everything that the mesh has stored."""
    if not mesh.is_editable:
        return
    if not made:
        remove(mesh)
        return
    group = getattr(mesh, NAME)
    names = {f"{key} {array.shape[1]}": array for key, array in made.items()}
    for name in set(group.keys()) - set(names):
        del group[name]
    for name, array in names.items():
        if name not in group:
            group[name] = np.ascontiguousarray(array, dtype=np.float32).tobytes()


def remove(mesh: bpy.types.Mesh) -> None:
    if mesh.is_editable and mesh.is_property_set(NAME):
        mesh.property_unset(NAME)


def register() -> None:
    setattr(bpy.types.Mesh, NAME, bpy.props.PointerProperty(type=SinewVertexData, options={"HIDDEN"}))


def unregister() -> None:
    delattr(bpy.types.Mesh, NAME)


CLASSES = (SinewVertexData,)
