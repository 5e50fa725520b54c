# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps settings on library overrides, which Blender does not save where the library has none.

Blender saves the modifier that Sinew adds, and the point buffer that it names is local: so the point buffer
stores a copy of the settings.
"""

import bpy

from . import node_group, properties, property_groups, stack


def store(obj: bpy.types.Object) -> None:
    """Copies the settings of a skinned override to its point buffer."""
    settings = properties.of(obj)
    point_buffer = settings.storage.point_buffer
    if obj.override_library is not None and point_buffer is not None:
        property_groups.copy(settings, properties.of(point_buffer))
        properties.of(point_buffer).identity.is_helper = True


def restore() -> None:
    """Restores settings that overrides have lost, from their point buffers."""
    for obj in bpy.data.objects:
        if obj.type != "MESH" or obj.override_library is None or properties.has_sinew(obj):
            continue
        nodes = stack.sinew_modifier(obj)
        point_buffer = node_group.get_input(nodes, "Points") if nodes is not None else None
        if isinstance(point_buffer, bpy.types.Object) and len(properties.of(point_buffer).replaced_modifiers):
            property_groups.copy(properties.of(point_buffer), properties.of(obj))
            properties.of(obj).identity.is_helper = False
