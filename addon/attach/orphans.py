# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew made for objects that were deleted since: point buffers, upstream proxies, node groups."""

from __future__ import annotations

import bpy

from . import node_group, properties, upstream_proxy


def remove(of_copies: bool = False) -> None:
    """Takes away what nothing in the file uses any more.

    of_copies  also what a comparison's copies had: Blender does not lower its counts of users when it deletes
               several of them at once
    """
    helpers = {
        obj
        for obj in bpy.data.objects
        if properties.is_helper(obj) and obj.library is None and (of_copies or obj.users == 0)
    }
    if helpers:
        for helper in [h for h, users in bpy.data.user_map(subset=helpers).items() if not users]:
            # A proxy's mesh is the artist's own, who may still want it.
            mesh = None if upstream_proxy.is_proxy(helper) else helper.data
            bpy.data.objects.remove(helper)
            if mesh is not None and mesh.users == 0:
                bpy.data.meshes.remove(mesh)
    node_group.remove_unused()
