# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes what Sinew made for objects that were deleted since: point buffers, upstream proxies, node
groups."""

import bpy

from . import node_group, properties, upstream_proxy


def remove() -> None:
    """Removes what nothing in the file uses any more.

    Blender's user counts cannot be trusted: they are too high after it has deleted several copies at once,
    and in 5.2 after a modifier was removed whose inputs name an object.
    """
    storages = [properties.of(obj).storage for obj in bpy.data.objects if properties.has_sinew(obj)]
    used = {helper for each in storages for helper in (each.point_buffer, each.upstream_proxy)}
    helpers = {
        obj
        for obj in bpy.data.objects
        if properties.is_helper(obj) and obj.library is None and obj not in used
    }
    if helpers:
        for helper in [h for h, users in bpy.data.user_map(subset=helpers).items() if not users]:
            upstream_proxy.remove_helper(helper)
    node_group.remove_unused()
