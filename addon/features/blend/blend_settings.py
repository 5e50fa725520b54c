# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of an armature object for a blend of its actions, in the .blend file."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...core.motion import blend as core
from ...core.motion.timing import Weights


class SinewBlendClip(bpy.types.PropertyGroup):
    """An action of a blend."""

    action: bpy.props.PointerProperty(
        type=bpy.types.Action, name="Action", description="An action that moves bones of this armature"
    )
    weight: bpy.props.FloatProperty(
        name="Weight",
        description="How much of the action is in the blend; weights are brought to sum 1",
        default=1.0,
        min=0.0,
        soft_max=1.0,
        options=set(),
    )
    weight_from: bpy.props.FloatProperty(
        name="At First",
        description="How much of the action is in the blend before its weights change",
        default=1.0,
        min=0.0,
        soft_max=1.0,
        options=set(),
    )


class SinewBlend(bpy.types.PropertyGroup):
    """A blend of an armature object's actions."""

    clips: bpy.props.CollectionProperty(type=SinewBlendClip, description="The actions to blend")
    method: bpy.props.EnumProperty(
        name="Method",
        description="How poses of a bone are blended",
        items=[(m.name, m.label, m.description, m.number) for m in core.METHODS.values()],
        default="dlb",
        options=set(),
    )
    space: bpy.props.EnumProperty(
        name="Space",
        description="Relative to what bones are blended",
        items=[
            (core.RELATIVE, "Parents", "Each bone relative to its parent: chains stay whole", 0),
            (
                core.ARMATURE,
                "Armature",
                "Each bone by itself: it keeps its direction, and bones that are not connected leave their "
                "parents",
                1,
            ),
        ],
        default=core.RELATIVE,
        options=set(),
    )
    align: bpy.props.BoolProperty(
        name="Align",
        description="Bring the actions to the same moment of their motion, and cycles to a common length; "
        "else each plays from its first frame",
        default=True,
        options=set(),
    )
    align_bone: bpy.props.StringProperty(
        name="Aligned by",
        description="The bone that says which moment it is, such as a foot; empty: all bones",
        options=set(),
    )
    changes: bpy.props.BoolProperty(
        name="Change Weights",
        description="Let the weights change in the course of the blend",
        default=False,
        options=set(),
    )
    change_start: bpy.props.FloatProperty(
        name="Begins At",
        description="The share of the motion after which weights change",
        subtype="PERCENTAGE",
        default=0.0,
        min=0.0,
        max=100.0,
        precision=0,
        options=set(),
    )
    change_end: bpy.props.FloatProperty(
        name="Ends At",
        description="The share of the motion after which they have changed",
        subtype="PERCENTAGE",
        default=100.0,
        min=0.0,
        max=100.0,
        precision=0,
        options=set(),
    )
    smooth: bpy.props.BoolProperty(
        name="Slow In and Out",
        description="Let the change of weights begin and end slowly; else it is even",
        default=False,
        options=set(),
    )
    cycles: bpy.props.IntProperty(
        name="Cycles",
        description="How often actions that repeat go round in the blend",
        default=1,
        min=1,
        soft_max=20,
        options=set(),
    )
    root_motion: bpy.props.EnumProperty(
        name="Root Motion",
        description="What becomes of the way that the root goes over the ground",
        items=[
            (core.TRAVEL, "Blended", "Steps of the root are blended and added up: speeds and turns blend", 0),
            (core.IN_PLACE, "In Place", "The way over the ground is taken out", 1),
            (core.KEYED, "As Keyed", "The root is blended as any other bone", 2),
        ],
        default=core.TRAVEL,
        options=set(),
    )
    root: bpy.props.StringProperty(
        name="Root",
        description="The bone that carries the others; empty: the uppermost that moves",
        options=set(),
    )

    def weights(self, clips: Sequence[SinewBlendClip]) -> Weights:
        """Returns the weights of some of its clips. Raises SinewError for invalid ones."""
        last = [clip.weight for clip in clips]
        if not self.changes:
            return Weights.of(last, len(last))
        first = [clip.weight_from for clip in clips]
        at = (0.01 * self.change_start, 0.01 * self.change_end)
        return Weights.of((first, last), len(last), at, self.smooth)

    def settings(self) -> core.Settings:
        return core.Settings(
            method=self.method,
            space=self.space,
            align=self.align,
            align_bones=(self.align_bone,) if self.align_bone else (),
            root=self.root or None,
            root_motion=self.root_motion,
            cycles=self.cycles,
        )


def of(armature: bpy.types.Object) -> SinewBlend | None:
    """Returns the blend of an armature object; None where nothing was ever added, as reading it would already
    store an empty one in the file."""
    return armature.sinew_blend if armature.is_property_set("sinew_blend") else None


def remove_clip(armature: bpy.types.Object, index: int) -> None:
    """Removes a clip. With the last one, the whole blend is removed from the file."""
    armature.sinew_blend.clips.remove(index)
    if not armature.sinew_blend.clips:
        armature.property_unset("sinew_blend")


CLASSES = (SinewBlendClip, SinewBlend)


def register() -> None:
    bpy.types.Object.sinew_blend = bpy.props.PointerProperty(type=SinewBlend)


def unregister() -> None:
    del bpy.types.Object.sinew_blend
