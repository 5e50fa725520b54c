# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's exporters of skins need Armature modifiers that deform, and bring the mesh itself to rest by
them: for the time of an export the file is as a saved one.

The glTF exporter calls extensions before and after it. The FBX exporter, in Python too, calls nobody (seen on
4.2 to 5.2), so its operator is wrapped.
"""

from __future__ import annotations

import functools

import bpy
from bpy.app.handlers import persistent

from . import events, handlers

_FBX = "EXPORT_SCENE_OT_fbx"


def before_export(*_settings: object) -> None:
    handlers.begin_export()


def after_export(*_settings: object) -> None:
    handlers.end_export()


def register() -> None:
    _wrap()
    events.subscribe("load_post", _on_loaded)


@persistent
def _on_loaded(*_args: object) -> None:
    _wrap()


def _wrap() -> None:
    """Where the FBX exporter is registered and not wrapped yet."""
    operator = getattr(bpy.types, _FBX, None)
    if operator is None or hasattr(operator.execute, "__wrapped__"):
        return
    execute = operator.execute

    @functools.wraps(execute)
    def execute_without_sinew(self: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
        before_export()
        try:
            return execute(self, context)
        finally:
            after_export()

    operator.execute = execute_without_sinew


def unregister() -> None:
    events.unsubscribe("load_post", _on_loaded)
    operator = getattr(bpy.types, _FBX, None)
    if operator is not None and hasattr(operator.execute, "__wrapped__"):
        operator.execute = operator.execute.__wrapped__
