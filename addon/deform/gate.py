# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Blender from evaluating a mesh twice where a change of frame itself makes it dirty.

Where Sinew deforms after the update, Blender evaluates on a change of frame, calls Sinew, and evaluates
again what Sinew wrote. A mesh that moves, or whose shape keys do, comes up in the first round too, with the
points of the last frame: all for nothing. So its modifiers are suspended until the points are there. To
suspend them has the mesh read anew: a mesh that is only posed keeps its modifiers, and is evaluated twice.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import bpy

from ..attach import node_group, stack
from ..io.animation_paths import animated_paths, curves_of, is_visibility_animated


@dataclass(frozen=True)
class _Suspended:
    """A modifier, known by what no other add-on changes in between: it may rename, move or delete it."""

    obj: bpy.types.Object
    uid: int
    show_viewport: bool
    show_render: bool

    def restore(self) -> None:
        for modifier in self.obj.modifiers:
            if modifier.persistent_uid == self.uid:
                # What somebody switched on meanwhile stays so.
                modifier.show_viewport |= self.show_viewport
                modifier.show_render |= self.show_render


class Gate:
    """The modifiers that are suspended between Blender's two rounds."""

    def __init__(self) -> None:
        self._suspended: list[_Suspended] = []

    def suspend(self, obj: bpy.types.Object, is_playing: bool) -> None:
        """is_playing: for a window that plays, whose animation Blender writes to the originals, too. Nothing
        says whether another change of frame is a view's, a render's or an exporter's."""
        if not is_playing and _is_animated(obj.data):
            return
        for modifier in obj.modifiers:
            if (
                stack.is_on(modifier)
                and not node_group.is_sinew(modifier)
                and not is_visibility_animated(obj, modifier)
            ):
                self._suspended.append(
                    _Suspended(obj, modifier.persistent_uid, modifier.show_viewport, modifier.show_render)
                )
                modifier.show_viewport = modifier.show_render = False

    def restore(self) -> None:
        suspended, self._suspended = self._suspended, []
        for each in suspended:
            # Its object may be gone.
            with contextlib.suppress(ReferenceError):
                each.restore()


# What a copy keeps, or Sinew works out itself.
_STAYING = ("location", "rotation_", "scale", "delta_", "sinew.")


def _is_animated(mesh: bpy.types.Mesh) -> bool:
    """Whether animation sets anything of an object that has the mesh, or shape keys that several have. To set
    a modifier of one of these objects has Blender (4.2 to 5.2) copy all of them anew, with what the originals
    have: in a render or an exporter that of another frame."""
    users = [obj for obj in bpy.data.objects if obj.data == mesh]
    if len(users) > 1 and any(curves_of(owner) for owner in (mesh, mesh.shape_keys) if owner is not None):
        return True
    return any(not path.startswith(_STAYING) for obj in users for path in animated_paths(obj))
