# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the originals of what an evaluation lists.

Blender frees at once what a handler deletes, but goes on listing its evaluated copy. The `original` of that
is a dangling pointer, and reading it can crash Blender.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy

from . import events

Find = Callable[[bpy.types.ID], bpy.types.ID | None]

_LISTS = (
    (bpy.types.Object, "objects"),
    (bpy.types.Mesh, "meshes"),
    (bpy.types.Key, "shape_keys"),
    (bpy.types.Armature, "armatures"),
)


def finder(event: str, function: Callable) -> Find:
    """Returns a function that finds the original of an evaluated object, mesh, shape key or armature,
    for use in `function`, which Blender calls at the event. The function returns None where another add-on's
    function may have deleted or renamed the original."""
    return _by_name if events.others_precede(event, function) else _at_once


def _at_once(evaluated: bpy.types.ID) -> bpy.types.ID:
    return evaluated.original


def _by_name(evaluated: bpy.types.ID) -> bpy.types.ID | None:
    name = next(name for kind, name in _LISTS if isinstance(evaluated, kind))
    library = evaluated.library
    return getattr(bpy.data, name).get((evaluated.name, library.filepath if library is not None else None))
