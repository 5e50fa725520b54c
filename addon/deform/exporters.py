# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's exporters of skins need Armature modifiers that deform, and bring the mesh itself to rest by
them: for the time of an export the file is as a saved one.

The glTF exporter calls extensions before an export and after one that did not fail. The FBX exporter, in
Python too, calls nobody (seen on 4.2 to 5.2). So both operators are wrapped.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent

from ..attach.subscribers import notify, subscribers
from . import events, handlers

_FBX, _GLTF = "EXPORT_SCENE_OT_fbx", "EXPORT_SCENE_OT_gltf"


def before_export(*_settings: object) -> None:
    handlers.begin_export()


def after_export(*_settings: object) -> None:
    notify(subscribers.exported)
    handlers.end_export()


def register() -> None:
    _wrap()
    events.subscribe("load_post", _on_loaded)


@persistent
def _on_loaded(*_args: object) -> None:
    _wrap()


def _wrap() -> None:
    """Those that are registered and not wrapped yet."""
    for name in (_FBX, _GLTF):
        operator = getattr(bpy.types, name, None)
        if operator is not None and not hasattr(operator.execute, "__wrapped__"):
            operator.execute = _without_sinew(operator.execute, announced=name == _GLTF)


def _without_sinew(execute: Callable, announced: bool) -> Callable:
    """announced: it calls before_export() itself."""

    @functools.wraps(execute)
    def execute_without_sinew(self: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
        if not announced:
            before_export()
        try:
            return execute(self, context)
        finally:
            after_export()

    return execute_without_sinew


def unregister() -> None:
    events.unsubscribe("load_post", _on_loaded)
    for name in (_FBX, _GLTF):
        operator = getattr(bpy.types, name, None)
        if operator is not None and hasattr(operator.execute, "__wrapped__"):
            operator.execute = operator.execute.__wrapped__
