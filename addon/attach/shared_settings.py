# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings that the meshes of a character share."""

from __future__ import annotations

import bpy

from . import properties

# Properties of properties.SinewSettings; all stages and parameters of methods are shared, too.
SHARED = ("method", "scale_rule", "normals", "leave_small")
GROUPS = properties.SETTING_GROUPS


def share(source: bpy.types.Object, target: bpy.types.Object) -> None:
    """Copies the shared settings of a mesh to another. The caller suspends updates meanwhile."""
    own, other = properties.of(target), properties.of(source)
    for name in SHARED:
        assign(own, name, getattr(other, name))
    for group, cls in GROUPS.items():
        for name in cls.__annotations__:
            assign(getattr(own, group), name, getattr(getattr(other, group), name))


def assign(group: bpy.types.PropertyGroup, name: str, value: object) -> None:
    """Assigns only a different value: each assignment makes Blender evaluate the object."""
    if getattr(group, name) != value:
        setattr(group, name, value)
