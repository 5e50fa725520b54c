# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers heat maps, and subscribes to what Sinew does with its objects."""

from __future__ import annotations

import bpy

from ...attach import properties
from ...attach.subscribers import subscribers
from ...attach.updates import is_rendering_in_window
from ...deform import session
from . import (
    bake_error,
    heat_legend,
    heat_map,
    heat_nodes,
    heat_panel,
    heat_view,
    measures,
    redraw,
    shown_colours,
)

CLASSES = (*measures.CLASSES, *heat_panel.CLASSES)


def register() -> None:
    measures.register()
    measures.Listener.changed = _measures_changed
    properties.listeners.heat_changed = _heat_changed
    # The artist's choices while colours are shown.
    bpy.types.Mesh.sinew_shown_colours = bpy.props.StringProperty(options={"HIDDEN"})
    bpy.types.Screen.sinew_colour_types = bpy.props.StringProperty(options={"HIDDEN"})
    for functions, function in _SUBSCRIPTIONS:
        functions.append(function)


def unregister() -> None:
    heat_legend.show(False)
    shown_colours.sync(())
    for obj in filter(bake_error.is_on, bpy.data.objects):
        if obj.type == "MESH":
            heat_nodes.remove_applied(obj.data)
        properties.clear(obj)
    for functions, function in _SUBSCRIPTIONS:
        functions.remove(function)
    measures.Listener.changed = properties.listeners.heat_changed = None
    del bpy.types.Mesh.sinew_shown_colours, bpy.types.Screen.sinew_colour_types
    measures.unregister()


def _measures_changed(context: bpy.types.Context) -> None:
    if not is_rendering_in_window():
        heat_view.sync_errors()
    session.refresh(context)


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
    heat_map.update(session.states_of(heated, depsgraph), depsgraph)


_SUBSCRIPTIONS = (
    (subscribers.node_group, heat_nodes.group_of),
    (subscribers.before_removal, _take_off),
    (subscribers.after_removal, heat_view.tidy),
    (subscribers.objects_changed, _objects_changed),
    (subscribers.deformed, _colour),
    (subscribers.frame_shown, redraw.request),
)
