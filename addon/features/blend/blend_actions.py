# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads actions of an armature, blends them, and writes a new action, in steps."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import bpy

from ...base.errors import SinewError
from ...base.steps import as_part
from ...io import spaces
from . import clips_io, motion

# Share of the progress: reading curves takes as long as writing keys.
READING = 0.5


@dataclass(frozen=True)
class Made:
    """The new action, which nothing plays yet, and the blend."""

    action: bpy.types.Action
    blend: motion.Blend

    @property
    def frames(self) -> int:
        return len(self.blend.poses.rigid)

    def notes(self) -> list[str]:
        """What a user should know about it, each a sentence."""
        found, blend = [], self.blend
        unsure = [blend.rig.names[bone] for bone in blend.undefined.any(axis=0).nonzero()[0]]
        if unsure:
            found.append(
                f"{', '.join(unsure[:3])}{' and others' if len(unsure) > 3 else ''}: the actions are half a "
                "turn apart in some frames, where a blend may jump"
            )
        volume, bone, frame = blend.smallest()
        if volume < 0.99:
            found.append(
                f"{bone} shrinks to {max(volume, 0.0):.0%} of its volume in frame {frame + 1} of the blend: "
                "another method keeps it"
            )
        return found


def make(
    armature: bpy.types.Object,
    chosen: Sequence[bpy.types.Action],
    weights: Sequence,
    settings: motion.Settings,
    name: str = "",
) -> Generator[float, None, Made]:
    """Yields the progress. The new action begins at the scene's first frame; if closed before the end,
    nothing has changed. Raises SinewError for what cannot be blended.

    weights  as motion.blend() takes them
    """
    if not armature.is_editable:
        raise SinewError(f"{armature.name} is linked: make a library override of it first")
    if len(chosen) < 2:
        raise SinewError(f"{armature.name}: choose two actions or more to blend")
    rig, sources = clips_io.rig_of(armature), []
    for number, action in enumerate(chosen):
        steps = clips_io.read(armature, action, rig)
        clip = yield from as_part(steps, READING * number / len(chosen), READING / len(chosen))
        sources.append(clip)
    blend = motion.blend(sources, weights, settings, spaces.up_of(armature))
    keyed = set().union(*(clips_io.keyed_properties(armature, action) for action in chosen))
    name = name or f"Blend {' '.join(action.name for action in chosen)}"
    first = float(bpy.context.scene.frame_start)
    steps = clips_io.write(armature, blend.clip(name), name, first, keyed)
    made = yield from as_part(steps, READING, 1.0 - READING)
    return Made(made, blend)
