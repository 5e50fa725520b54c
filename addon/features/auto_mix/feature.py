# SPDX-License-Identifier: GPL-3.0-or-later
"""Auto-Mix: an operator, whose button is beside Mix's settings."""

from collections.abc import Iterator

import bpy

from ...attach import properties
from ...attach.feature import Feature
from ...base.errors import SinewError
from ...ui import stepped
from ...ui.operators import OfOneMesh, OnSinewObjects, sinew_targets
from . import auto_mix


class SINEW_OT_auto_mix(OnSinewObjects, OfOneMesh, stepped.Stepped, bpy.types.Operator):
    bl_label = "Auto-Mix"
    bl_description = (
        "Measure both methods of the mix over the frames, and paint its vertex group: at each vertex the one "
        "with less stretch, lost volume and self-intersection, smoothed over the surface. Without a second "
        "method it takes dual quaternions, or linear blending beside them"
    )
    saying = "Sinew measures two methods"

    over: bpy.props.EnumProperty(**stepped.OVER_WHICH, default="SCENE")
    smoothing: bpy.props.FloatProperty(
        name="Smoothing",
        description="How far a change from one method to the other reaches, in thicknesses of the limb",
        default=0.3,
        min=0.0,
        soft_max=2.0,
    )

    def steps(self, context: bpy.types.Context) -> Iterator[float]:
        meant = self.meant(sinew_targets(context))
        if not self.name:
            meant = [obj for obj in meant if not properties.of(obj).is_own] or meant
        reasons = {obj: auto_mix.why_not(obj) for obj in meant}
        objects = [obj for obj in meant if not reasons[obj]]
        self.left_out = list(filter(None, reasons.values()))
        if not objects:
            raise SinewError(self.left_out[0] if self.left_out else "Select a mesh that Sinew deforms")
        self.mixing = auto_mix.AutoMix(context.scene, objects, self.over, self.smoothing)
        yield from self.mixing.steps()

    def run(self, context: bpy.types.Context) -> None:
        for sentence in self.left_out:
            self.report({"WARNING"}, sentence)
        for sentence in self.mixing.write(context):
            self.report({"INFO"}, sentence)


FEATURE = Feature((SINEW_OT_auto_mix,))
