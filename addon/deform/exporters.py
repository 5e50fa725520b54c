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

from ..attach.subscribers import notify, subscribers
from . import lifecycle

_FBX, _GLTF = "EXPORT_SCENE_OT_fbx", "EXPORT_SCENE_OT_gltf"


def before_export(*_settings: object) -> None:
    lifecycle.begin_export()


def after_export(*_settings: object) -> None:
    notify(subscribers.exported)
    lifecycle.end_export()


def register() -> None:
    _wrap()
    subscribers.loaded.append(_wrap)


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
    subscribers.loaded.remove(_wrap)
    for name in (_FBX, _GLTF):
        operator = getattr(bpy.types, name, None)
        if operator is not None and hasattr(operator.execute, "__wrapped__"):
            operator.execute = operator.execute.__wrapped__
