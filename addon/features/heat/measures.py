# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of measures and heat maps, stored in the scene."""

from collections.abc import Callable

import bpy

from ...attach import properties
from ...attach.updates import is_rendering_in_window
from ...deform import session
from ..measure.diagnostics import USUAL_INFLUENCES
from ..measure.heat_scale import HeatScale
from ..measure.metrics import METRICS, Metric

PER_FRAME, FIXED = "FRAME", "FIXED"
# Of meshes that were baked to bones.
BAKE_ERRORS = {
    metric.name: metric
    for metric in (
        Metric(
            "bake_error",
            "Bake error",
            "length",
            "linear",
            "",
            "How far a vertex that was baked to bones is from Sinew's shape: RMS over the bake's frames.",
        ),
        Metric(
            "bake_error_before",
            "Bake error before",
            "length",
            "linear",
            "",
            "The same of linear blending with the weights before the bake.",
        ),
    )
}
QUANTITIES = METRICS | BAKE_ERRORS


# Called after a change: what updates meshes and views.
listeners: list[Callable[[], None]] = []


def _changed(_settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    if not is_rendering_in_window():
        for listener in listeners:
            listener()
    session.refresh(context)


class SinewMeasures(bpy.types.PropertyGroup):
    """Settings of a scene: its meshes share one range and one legend."""

    quantity: bpy.props.EnumProperty(
        name="Measure",
        description="What the heat map shows and worst frames are found by",
        items=[(m.name, m.label, m.text, number) for number, m in enumerate(QUANTITIES.values())],
        default="stretch",
        options=set(),
        update=_changed,
    )
    other: bpy.props.EnumProperty(
        name="Compared with",
        description="What distances are measured to",
        items=properties.method_choices(),
        options=set(),
        update=_changed,
    )
    range: bpy.props.EnumProperty(
        name="Range",
        description="Which values the colours stand for",
        items=[
            (PER_FRAME, "Per Frame", "As wide as each frame's own values", 0),
            (FIXED, "Fixed", "The same at all frames, so that frames compare", 1),
        ],
        options=set(),
        update=_changed,
    )
    length: bpy.props.FloatProperty(
        name="Up to",
        description="The length that the last colour stands for",
        default=0.1,
        min=1e-6,
        soft_max=10.0,
        precision=4,
        subtype="DISTANCE",
        options=set(),
        update=_changed,
    )
    ratio: bpy.props.FloatProperty(
        name="Up to",
        description="The ratio that the last colour stands for; the first stands for one divided by it",
        default=2.0,
        min=1.01,
        soft_max=4.0,
        max=100.0,
        options=set(),
        update=_changed,
    )

    @property
    def metric(self) -> Metric:
        return QUANTITIES[self.quantity]

    @property
    def end(self) -> str:
        """The setting with the end of a fixed range; empty for measures that need none."""
        return self.metric.unit if self.metric.unit != "share" and self.quantity in METRICS else ""

    def fix(self, scale: HeatScale) -> None:
        """Fixes the range to that of a scale."""
        if self.end:
            setattr(self, self.end, scale.high)
        self.range = FIXED


def of(scene: bpy.types.Scene) -> SinewMeasures:
    """Reading them makes them, in a scene that had none."""
    return scene.sinew_measures


def clear(scene: bpy.types.Scene) -> None:
    scene.property_unset("sinew_measures")
    scene.property_unset("sinew_most_influences")


PROPERTIES = {
    "Scene.sinew_measures": bpy.props.PointerProperty(type=SinewMeasures),
    # Not in that group, as this setting is also read in files without anything of Sinew's.
    "Scene.sinew_most_influences": bpy.props.IntProperty(
        name="Most Influences",
        description="How many bones may move a vertex before it is reported",
        default=USUAL_INFLUENCES,
        min=1,
        soft_max=8,
        options=set(),
    ),
}
