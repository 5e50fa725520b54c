# SPDX-License-Identifier: GPL-3.0-or-later
"""Blends of actions: an operator; its dialog lists those of the armature."""

from collections.abc import Iterator

import bpy

from ...attach.feature import Feature
from ...base.errors import SinewError
from ...base.options import read_options
from ...io import actions
from ...ui import operators, stepped
from ...ui.options import with_options
from ...ui.sidebar import draw_text
from ...ui.translations import counted, tr
from . import blend_actions, clips_io, motion


class SinewBlendAction(bpy.types.PropertyGroup):
    """An action in the dialog, called `name`."""

    weight: bpy.props.FloatProperty(
        name="Weight",
        description="How much of the action is in the blend; weights are brought to sum 1",
        default=1.0,
        min=0.0,
        soft_max=1.0,
    )
    weight_from: bpy.props.FloatProperty(
        name="At First",
        description="How much of the action is in the blend before its weights change",
        default=1.0,
        min=0.0,
        soft_max=1.0,
    )


@with_options(motion.Settings)
class SINEW_OT_blend_actions(stepped.WithDialog, bpy.types.Operator):
    bl_label = "Blend Actions"
    bl_description = (
        "Blend actions of the armature into a new one of plain keys, which it plays; the actions themselves "
        "stay as they are"
    )
    saying = "Sinew blends actions"

    actions: bpy.props.CollectionProperty(
        type=SinewBlendAction, description="The actions to blend", options={"SKIP_SAVE"}
    )
    changes: bpy.props.BoolProperty(
        name="Change Weights",
        description="Let the weights change evenly from the first frame to the last",
        default=False,
    )

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        armature = _armature(context)
        if armature is None:
            return "Select an armature, or a mesh that it deforms"
        if not armature.is_editable:
            return tr("{name} is linked: make a library override of it first", name=armature.name)
        return ""

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.actions:
            armature = _armature(context)
            playing = armature.animation_data.action if armature.animation_data is not None else None
            found = dict.fromkeys(action for action in (playing, *bpy.data.actions) if action is not None)
            for action in found:
                if clips_io.keyed_properties(armature, action):
                    row = self.actions.add()
                    row.name, row.weight = action.name, float(len(self.actions) <= 2)
        return super().invoke(context, event)

    def draw(self, context: bpy.types.Context) -> None:
        layout, armature = self.layout, _armature(context)
        layout.use_property_split = True
        for each in self.actions:
            column = layout.column(align=True)
            if self.changes:
                column.prop(each, "weight_from", text=tr("{name}, at First", name=each.name), translate=False)
            column.prop(each, "weight", text=each.name, translate=False)
        if len(self.actions) < 2:
            draw_text(layout, "Blender has no two actions of this armature", icon="INFO")
        for name in ("changes", "method", "align", "cycles", "root_motion"):
            layout.prop(self, name)
        if self.root_motion == motion.TRAVEL or self.align:
            layout.prop_search(self, "root", armature.data, "bones")

    def values(self) -> dict[str, object]:
        rows = [{name: getattr(each, name) for name in _OF_ACTION} for each in self.actions]
        return {**super().values(), "actions": rows}

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = _armature(context)
        # By name: after undo, or loading another file, pointers would be invalid.
        self._armature = armature.name
        chosen = [each for each in self.actions if each.weight or (self.changes and each.weight_from)]
        missing = [each.name for each in chosen if each.name not in bpy.data.actions]
        if missing:
            raise SinewError(f"There is no action {missing[0]!r}")
        weights = [each.weight for each in chosen]
        if self.changes:
            weights = [[each.weight_from for each in chosen], weights]
        self._made = yield from blend_actions.make(
            armature,
            [bpy.data.actions[each.name] for each in chosen],
            weights,
            read_options(motion.Settings, self),
        )

    def run(self, context: bpy.types.Context) -> None:
        made = self._made
        actions.play(bpy.data.objects[self._armature], made.action)
        frames = counted(made.frames, "{count} frame", "{count} frames")
        self.report({"INFO"}, tr("Made {name}: {frames}", name=made.action.name, frames=frames))
        for note in made.notes():
            self.report({"WARNING"}, note)
        context.view_layer.update()


_OF_ACTION = ("name", "weight", "weight_from")


def _armature(context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature whose actions are blended: the active one, or the one of the active mesh."""
    return next(iter(operators.armatures(context)), None)


FEATURE = Feature((SinewBlendAction, SINEW_OT_blend_actions))
