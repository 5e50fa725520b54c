# SPDX-License-Identifier: GPL-3.0-or-later
"""Corrective shape keys: an operator."""

import bpy

from ...attach import properties
from ...attach.feature import Feature
from ...base.errors import SinewError
from ...io import units
from ...ui.operators import OnSinewObjects, sinew_targets
from ...ui.translations import tr
from . import corrective_key


class SINEW_OT_corrective_key(OnSinewObjects, bpy.types.Operator):
    bl_label = "Corrective Shape Key"
    bl_description = (
        "Add a shape key by which the Armature modifier alone has the shape that Sinew shows in this pose. "
        "It is muted, as Sinew's shape has it already"
    )

    driven: bpy.props.BoolProperty(
        name="Driven by the Active Bone",
        description="The key grows as the active pose bone turns against its parent, from rest to this pose",
        default=False,
    )

    def run(self, context: bpy.types.Context) -> set[str]:
        bone, made = self._bone(context), 0
        for obj in sinew_targets(context):
            if not properties.of(obj).enabled:
                continue
            try:
                key, *off = corrective_key.add(obj, context.evaluated_depsgraph_get(), bone)
            except SinewError as error:
                self.report({"WARNING"}, str(error))
                continue
            made += 1
            before, after = (units.text(context.scene, "length", each) for each in off)
            text = tr(
                "{name}: {key} is there, and muted; the Armature modifier is {before} off without it, "
                "{after} with it",
                name=obj.name,
                key=key,
                before=before,
                after=after,
            )
            self.report({"INFO"}, text)
        return {"FINISHED"} if made else {"CANCELLED"}

    def _bone(self, context: bpy.types.Context) -> bpy.types.PoseBone | None:
        if not self.driven:
            return None
        if context.active_pose_bone is None:
            raise SinewError("Choose a bone in Pose Mode to drive the key by")
        return context.active_pose_bone


FEATURE = Feature((SINEW_OT_corrective_key,))
