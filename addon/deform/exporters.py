# SPDX-License-Identifier: GPL-3.0-or-later
"""Wraps Blender's exporters of skins: they need Armature modifiers that deform, and use them to bring the
mesh to rest. During an export the file is therefore as in a saved state.

The glTF exporter calls extensions before an export, but afterwards only if it did not fail. The FBX exporter,
also written in Python, calls nobody (seen on 4.2 to 5.2). So both operators are wrapped.
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
    """Wraps those that are registered and not wrapped yet."""
    for name in (_FBX, _GLTF):
        operator = getattr(bpy.types, name, None)
        if operator is not None and not hasattr(operator.execute, "__wrapped__"):
            operator.execute = _without_sinew(operator.execute, announced=name == _GLTF)


def _without_sinew(execute: Callable, announced: bool) -> Callable:
    """announced: the exporter itself calls before_export()."""

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
