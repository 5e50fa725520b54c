# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Blender from evaluating a mesh twice where a change of frame itself makes it dirty.

Where Sinew deforms after the update, Blender evaluates on a change of frame, calls Sinew, and evaluates again
what Sinew wrote. A mesh that moves, or whose shape keys do, is evaluated in the first round, too, with the
points of the last frame: wasted time. So its modifiers are suspended until the points are there. Suspending
them makes Blender read the mesh again: so a mesh that is only posed keeps its modifiers, and is evaluated
twice.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import bpy

from ..attach import node_group, stack
from ..io.animation_paths import animated_paths, curves_of, is_visibility_animated


@dataclass(frozen=True)
class _Suspended:
    """A modifier, identified so that another add-on may rename, move or delete it in between."""

    obj: bpy.types.Object
    uid: int
    show_viewport: bool
    show_render: bool

    def restore(self) -> None:
        for modifier in self.obj.modifiers:
            if modifier.persistent_uid == self.uid:
                # A modifier that somebody switched on meanwhile stays on.
                modifier.show_viewport |= self.show_viewport
                modifier.show_render |= self.show_render


class Gate:
    """The modifiers that are suspended between Blender's two rounds."""

    def __init__(self) -> None:
        self.suspended: list[_Suspended] = []

    def suspend(self, obj: bpy.types.Object, is_playing: bool) -> None:
        """is_playing: a window plays the animation, so Blender writes its values to the originals, too. Other
        changes of frame cannot be told apart: a view's, a render's or an exporter's."""
        if not is_playing and _is_animated(obj.data):
            return
        for modifier in obj.modifiers:
            if (
                stack.is_on(modifier)
                and not node_group.is_sinew(modifier)
                and not is_visibility_animated(obj, modifier)
            ):
                self.suspended.append(
                    _Suspended(obj, modifier.persistent_uid, modifier.show_viewport, modifier.show_render)
                )
                modifier.show_viewport = modifier.show_render = False

    def restore(self) -> None:
        suspended, self.suspended = self.suspended, []
        for each in suspended:
            # Its object may be gone.
            with contextlib.suppress(ReferenceError):
                each.restore()


# Values that a new copy keeps, or that Sinew computes itself.
_STAYING = ("location", "rotation_", "scale", "delta_", "sinew.")


def _is_animated(mesh: bpy.types.Mesh) -> bool:
    """Whether animation sets anything of an object with this mesh, or of shape keys that several objects
    share. Changing a modifier of one of these objects makes Blender (4.2 to 5.2) copy all of them again from
    the originals, which in a render or an exporter have the values of another frame."""
    users = [obj for obj in bpy.data.objects if obj.data == mesh]
    if len(users) > 1 and any(curves_of(owner) for owner in (mesh, mesh.shape_keys) if owner is not None):
        return True
    return any(not path.startswith(_STAYING) for obj in users for path in animated_paths(obj))
