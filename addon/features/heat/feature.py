# SPDX-License-Identifier: GPL-3.0-or-later
"""Heat maps: panels and their buttons, what a scene stores, a legend in the 3D views, and colours of each
frame."""

import bpy

from ...attach import properties
from ...attach.feature import Feature
from ...attach.subscribers import subscribers
from ...attach.updates import is_rendering_in_window
from ...deform import session
from ..measure import measured_on
from . import bake_error, heat_legend, heat_map, heat_nodes, heat_panel, heat_view, measures


def _begin() -> None:
    properties.listeners.heat_changed = _heat_changed


def _end() -> None:
    heat_panel.end()
    heat_view.activate(())
    for obj in filter(bake_error.is_on, bpy.data.objects):
        if obj.type == "MESH":
            heat_nodes.remove_applied(obj.data)
        properties.clear(obj)


def _heat_changed(obj: bpy.types.Object, context: bpy.types.Context) -> None:
    # Otherwise this is done at the end of the render.
    if not is_rendering_in_window() and not properties.of(obj).heat:
        heat_view.take_off(obj)
    if properties.has_sinew(obj):
        session.setting_changed(obj, context)
    if is_rendering_in_window():
        return
    if properties.has_sinew(obj):
        heat_view.tidy()
    else:
        heat_view.sync_errors()


def _take_off(obj: bpy.types.Object) -> None:
    if properties.of(obj).heat:
        heat_view.take_off(obj)


def _objects_changed(_objects: list[bpy.types.Object]) -> None:
    heat_view.sync()
    if not is_rendering_in_window():
        heat_nodes.remove_unused_material()


def _colour(objects: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph) -> None:
    heated = [obj for obj in objects if properties.of(obj).heat]
    heat_map.update(session.deformed_now(heated, depsgraph), depsgraph)


FEATURE = Feature(
    (measures.SinewMeasures, *heat_panel.CLASSES),
    {
        **measures.PROPERTIES,
        # The artist's choices while colours are shown.
        "Mesh.sinew_shown_colours": bpy.props.StringProperty(options={"HIDDEN"}),
        "Screen.sinew_colour_types": bpy.props.StringProperty(options={"HIDDEN"}),
    },
    subscriptions=(
        (subscribers.node_group, heat_nodes.group_of),
        (subscribers.before_removal, _take_off),
        (subscribers.after_removal, heat_view.tidy),
        (subscribers.objects_changed, _objects_changed),
        (subscribers.deformed, _colour),
        (measures.listeners, heat_view.sync_errors),
        *measured_on.SUBSCRIPTIONS,
    ),
    overlays=(heat_legend.draw,),
    begin=_begin,
    end=_end,
)
