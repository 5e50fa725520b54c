# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens: an operator that keys them."""

from collections.abc import Iterator

import bpy

from ...attach.feature import Feature
from ...ui import operators, stepped
from ...ui.translations import tr
from ..action_copy.feature import OnArmature, selected_bones
from . import inbetween_bake, interpolation


class SINEW_OT_bake_inbetweens(OnArmature, stepped.WithDialog, bpy.types.Operator):
    bl_label = "Bake In-betweens"
    bl_description = (
        "Move the selected bones, or all, between the keyed poses of their action by another method than "
        "curves, by plain keys in a copy of the action"
    )
    saying = "Sinew keys in-betweens"

    method: bpy.props.EnumProperty(
        name="Method",
        description="How the bones move between the keyed poses of the action",
        items=[(m.name, m.label, m.description, m.number) for m in interpolation.METHODS.values()],
        default="qv_slerp",
    )
    path: bpy.props.EnumProperty(
        name="Path",
        description="Which keyed poses shape the way from one to the next",
        items=[
            (
                interpolation.STRAIGHT,
                "Key to Key",
                "The two neighbours, at the pace of the keys' own interpolation",
            ),
            (
                interpolation.SPLINE,
                "Spline",
                "Catmull-Rom through four keyed poses: smooth at keys, at the spline's pace",
            ),
        ],
    )
    step: bpy.props.IntProperty(
        name="Step", description="Frames from one baked key to the next", default=1, min=1, soft_max=12
    )

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = operators.armatures(context)[0]
        only = selected_bones(armature)
        self._baked = yield from inbetween_bake.steps(armature, self.method, self.path, self.step, only)

    def run(self, context: bpy.types.Context) -> None:
        baked = self._baked
        action = baked.armature.animation_data.action
        self.report({"INFO"}, tr("{count} bones into {action}", count=baked.bones, action=action.name))
        for note in baked.notes(self.path):
            self.report({"WARNING"}, note)
        context.view_layer.update()


FEATURE = Feature((SINEW_OT_bake_inbetweens,))
