# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores methods' vertex data in the mesh that it belongs to, so that it need not be computed again when a
saved file is opened. The key is a hash of what the data was made from: a changed mesh finds no data.

It is a property of the mesh, not an attribute: downstream modifiers would interpolate that in every frame.
"""

import hashlib
import logging
from collections.abc import Mapping

import bpy
import numpy as np

from .feature import Feature

NAME = "sinew_vertex_data"

log = logging.getLogger("sinew")


class SinewVertexData(bpy.types.PropertyGroup):
    """Bytes of float32 [vertices, n] by their key, "KEY n HASH", with a hash of the bytes."""


def read(mesh: bpy.types.Mesh) -> dict[str, np.ndarray]:
    """Returns float32 [vertices, n] by its key; copies. Leaves out what is damaged."""
    if not mesh.is_property_set(NAME):
        return {}
    found = {}
    for name, content in getattr(mesh, NAME).items():
        key, width, digest = (*name.split(" "), "", "")[:3]
        if isinstance(content, bytes) and digest == _digest(content) and width.isdecimal():
            found[key] = np.frombuffer(content, dtype=np.float32).reshape(-1, int(width))
        else:
            log.warning(
                "%s: what a method had stored in this mesh is damaged; it is computed anew", mesh.name
            )
    return found


def _digest(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def write(mesh: bpy.types.Mesh, made: Mapping[str, np.ndarray]) -> None:
    """Replaces everything that the mesh has stored."""
    if not mesh.is_editable:
        return
    if not made:
        remove(mesh)
        return
    group = getattr(mesh, NAME)
    wanted = {}
    for key, array in made.items():
        content = np.ascontiguousarray(array, dtype=np.float32).tobytes()
        wanted[f"{key} {array.shape[1]} {_digest(content)}"] = content
    for name in set(group.keys()) - set(wanted):
        del group[name]
    for name, content in wanted.items():
        if group.get(name) != content:
            group[name] = content


def remove(mesh: bpy.types.Mesh) -> None:
    if mesh.is_editable and mesh.is_property_set(NAME):
        mesh.property_unset(NAME)


FEATURE = Feature(
    (SinewVertexData,),
    {f"Mesh.{NAME}": bpy.props.PointerProperty(type=SinewVertexData, options={"HIDDEN"})},
)
