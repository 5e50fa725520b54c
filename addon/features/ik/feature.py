# SPDX-License-Identifier: GPL-3.0-or-later
"""Inverse kinematics: an operator that keys it."""

from collections.abc import Iterator

import bpy
import numpy as np

from ...attach.feature import Feature
from ...deform import characters
from ...io import ik_io
from ...ui import operators, stepped
from ...ui.translations import tr
from ..action_copy.feature import OnArmature, selected_bones
from . import ik_bake


class SINEW_OT_bake_ik(OnArmature, stepped.WithDialog, bpy.types.Operator):
    bl_label = "Bake Sinew IK"
    bl_description = (
        "Solve the IK constraints of the selected bones' chains, or of all, by Sinew, and key the result in "
        "a copy of the action; the constraints are muted until Original Action"
    )

    saying = "Sinew solves inverse kinematics"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH)

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        armature = operators.armatures(context)[0]
        frames = stepped.frames_over(context.scene, [armature], self.over)
        with stepped.kept_frame(context.scene, [armature]):
            trees = ik_io.read_trees(armature, selected_bones(armature))
            self._found = yield from ik_bake.steps(armature, trees, frames)

    def run(self, context: bpy.types.Context) -> None:
        # The baked action applies at the current frame, too.
        characters.set_frame(context.scene, context.scene.frame_float)
        bones = sum(len(each.tree.bones) for each in self._found)
        worst = max(float(np.max(each.errors)) for each in self._found)
        text = tr(
            "{count} bones keyed; the tips are at most {share} of a chain's length off",
            count=bones,
            share=f"{worst:.2%}",
        )
        self.report({"INFO"}, text)


FEATURE = Feature((SINEW_OT_bake_ik,))
