# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects show a heat map, and what has to be done where one begins or ends."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...attach import node_group, properties
from ...ui import shown_colours
from . import heat_legend, heat_nodes, measures


def shown() -> Iterator[tuple[bpy.types.Mesh, str]]:
    """A source of shown_colours."""
    for obj in filter(properties.has_sinew, bpy.data.objects):
        if properties.of(obj).heat and properties.of(obj).enabled:
            yield obj.data, heat_nodes.NAME


def sync_legend() -> None:
    heat_legend.show(any(shown()))


def take_off(obj: bpy.types.Object) -> None:
    """Removes the heat map from an object, except its node group."""
    properties.of(obj).property_unset("heat")
    # First, as Blender chooses another active colour attribute when that one is removed.
    shown_colours.sync()
    sync_legend()
    heat_nodes.remove_colours(obj)
    heat_nodes.remove_applied(obj.data)


def tidy() -> None:
    """Removes what no object needs any more."""
    node_group.remove_unused()
    heat_nodes.remove_unused_material()
    if not any(map(properties.has_sinew, bpy.data.objects)):
        for scene in bpy.data.scenes:
            if scene.is_editable:
                measures.clear(scene)
