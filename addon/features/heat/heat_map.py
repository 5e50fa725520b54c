# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map: in each frame, the chosen measure as vertex colours of the objects that show it."""

import bpy
import numpy as np

from ...attach import properties
from ...deform.skinned_object import SkinnedObject
from ...ui.translations import joined, tr
from ..measure import live
from ..measure.heat_scale import HeatScale
from ..measure.metrics import Measured
from . import bake_error, heat_legend, heat_nodes, measures
from .measures import SinewMeasures

# The inputs of the last colours, by the session_uid of the scene.
_last: dict[int, tuple] = {}


def update(heated: live.SkinnedObjects, depsgraph: bpy.types.Depsgraph) -> None:
    """Colours those objects with a heat map that are in the evaluated scene, if anything changed. An object
    that its Armature modifier deforms has no point buffer, and shows no colours."""
    if not heated:
        if _last:
            live.forget()
        _last.clear()
        heat_legend.contents.clear()
        return
    scene = depsgraph.scene.session_uid
    shown = [
        (obj, skinned)
        for obj, skinned in heated
        if obj.evaluated_get(depsgraph).is_evaluated and _has_points(obj, skinned)
    ]
    if not shown:
        _last.pop(scene, None)
        heat_legend.contents.pop(scene, None)
        return
    settings = measures.of(depsgraph.scene)
    subject = live.measure(shown, settings.other, depsgraph)
    if subject is None:
        return
    choices = settings.quantity, settings.range, settings.length, settings.ratio
    # The object, not its id: an id could be reused after the object is gone.
    known, *known_choices = _last.get(scene, (None,))
    is_same = known is subject.measured and tuple(known_choices) == choices
    if is_same and all(heat_nodes.has_colours(obj) for obj, _state in shown):
        return
    values = _values(subject, settings.quantity)
    scale = scale_of(settings, subject.measured, values)
    colours = scale.linear_colours(values)
    for (obj, _state), own in zip(shown, subject.split(colours), strict=True):
        heat_nodes.write_colours(obj, own)
    _last[scene] = (subject.measured, *choices)
    heat_legend.contents[scene] = scale, _title(settings, shown)


def _has_points(obj: bpy.types.Object, skinned: SkinnedObject) -> bool:
    """Whether its point buffer is filled: that of a copied object is not, until the copy is deformed."""
    buffer = properties.of(obj).storage.point_buffer
    return buffer is not None and len(buffer.data.vertices) == len(skinned.bound.source.points)


def _values(subject: live.Subject, quantity: str) -> np.ndarray:
    """[vertices of all]"""
    if quantity not in measures.BAKE_ERRORS:
        return subject.measured.field(quantity)
    return np.concatenate(
        [bake_error.errors_of(part.obj.data, quantity, part.surface.vertex_count) for part in subject.parts]
    )


def scale_of(settings: SinewMeasures, measured: Measured, values: np.ndarray) -> HeatScale:
    """Returns the range of values that the colours cover."""
    metric, diagonal = settings.metric, measured.rest.diagonal
    least, most = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    if settings.range == measures.PER_FRAME or not settings.end:
        return HeatScale.over_values(metric, least, most, diagonal)
    return HeatScale.fixed(metric, getattr(settings, settings.end), least, most)


def _title(settings: SinewMeasures, shown: live.SkinnedObjects) -> str:
    """Returns the measure, and the methods."""
    methods = list(dict.fromkeys(properties.method_label(properties.of(obj).method) for obj, _state in shown))
    text = f"{tr(settings.metric.label)}, {joined(methods)}"
    if settings.quantity != "distance":
        return text
    return tr("{text} against {method}", text=text, method=tr(properties.method_label(settings.other)))
