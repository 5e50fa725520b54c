# SPDX-License-Identifier: GPL-3.0-or-later
"""What all bakes have in common, and what they read of an object.

A bake runs in steps, so that a window stays responsive and it can be stopped at any time.
"""

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy

from ...attach import attach, corrective_smooth, properties
from ...base.errors import SinewError
from ...base.output import remove
from ...deform import session
from ...deform.plan import ARMATURE_MODIFIER_MODES
from ...deform.skinned_object import SkinnedObject
from . import baked_files, kept


class Started:
    """
    frames  ascending
    what    what is baked, in words
    """

    frames: Sequence[float]
    what: str

    def sample(self) -> Generator[float, None, None]:
        """Goes through the frames; yields the progress, 0 to 1."""
        raise NotImplementedError

    def place(self) -> None:
        """Puts the result into the open file."""

    @property
    def files(self) -> list[tuple[Path, Path]]:
        """Each file that is written, with the name that publish() gives it."""
        return []

    def publish(self) -> None:
        for unfinished, path in self.files:
            baked_files.publish(unfinished, path)

    def discard(self) -> None:
        """Removes what was written."""
        for unfinished, _path in self.files:
            remove(unfinished)

    @contextmanager
    def whole_or_nothing(self) -> Iterator[None]:
        """Context that discards the bake where it is left before its end."""
        try:
            yield
        except BaseException:
            self.discard()
            raise


def take_off(obj: bpy.types.Object) -> None:
    """Takes Sinew off an object whose shape is in a bake from now on; the Armature modifiers stay as they
    were, and anything that the bake already includes is switched off."""
    kept.note_variant(obj)
    # A deforming parent would deform the baked shape again.
    properties.of(obj).before.parent_type = ""
    smooth = corrective_smooth.replaced_modifier(obj)
    attach.take_off(obj)
    if smooth is not None:
        smooth.show_viewport = smooth.show_render = False


def use_copy_of_mesh(obj: bpy.types.Object) -> bpy.types.Mesh:
    """Gives an object its own copy of its mesh, which it returns. The one without the bake stays in the file,
    so that the artist can return to it."""
    mesh = obj.data.copy()
    if obj.data.is_editable:
        obj.data.use_fake_user = True
    obj.data = mesh
    return mesh


def check_on(obj: bpy.types.Object) -> None:
    """Raises SinewError where Sinew is off."""
    if not properties.of(obj).enabled:
        raise _off(obj)


def skinned_now(obj: bpy.types.Object) -> SkinnedObject:
    """Returns the object's state at the current frame. Raises SinewError where Sinew does not give its
    modifier a shape."""
    # The depsgraph as it was evaluated for the frame: evaluating what Sinew wrote since is not needed.
    pairs = session.deformed_now([obj], bpy.context.view_layer.depsgraph)
    if not pairs or obj.mode in ARMATURE_MODIFIER_MODES:
        raise _off(obj)
    return pairs[0][1]


def posed_now(obj: bpy.types.Object) -> SkinnedObject:
    """Returns the same where its first Armature modifier takes part; otherwise raises SinewError."""
    state = skinned_now(obj)
    if state.shown.frames[0] is None:
        raise _off(obj)
    return state


def _off(obj: bpy.types.Object) -> SinewError:
    return SinewError(properties.of(obj).error or f"{obj.name}: switch Sinew on to bake what it shows")
