# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens: an operator that keys them."""

from collections.abc import Iterator
from dataclasses import asdict

import bpy

from ...attach.feature import Feature
from ...base.options import read_options
from ...ui import operators, stepped
from ...ui.options import with_options
from ...ui.translations import tr
from ..action_copy.feature import OnArmature, selected_bones
from . import inbetween_bake
from .interpolation import InbetweenOptions


@with_options(InbetweenOptions)
class SINEW_OT_bake_inbetweens(OnArmature, stepped.WithDialog, bpy.types.Operator):
    bl_label = "Bake In-betweens"
    bl_description = (
        "Move the selected bones, or all, between the keyed poses of their action by another method than "
        "curves, by plain keys in a copy of the action"
    )
    saying = "Sinew keys in-betweens"

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = operators.armatures(context)[0]
        options, only = read_options(InbetweenOptions, self), selected_bones(armature)
        self._baked = yield from inbetween_bake.steps(armature, only=only, **asdict(options))

    def run(self, context: bpy.types.Context) -> None:
        baked = self._baked
        action = baked.armature.animation_data.action
        self.report({"INFO"}, tr("{count} bones into {action}", count=baked.bones, action=action.name))
        for note in baked.notes(self.path):
            self.report({"WARNING"}, note)
        context.view_layer.update()


FEATURE = Feature((SINEW_OT_bake_inbetweens,))
