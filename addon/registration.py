# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers Sinew with Blender, and unregisters it."""

from __future__ import annotations

import atexit
import logging
import sys
from importlib import import_module
from typing import TYPE_CHECKING

import bpy

from . import native

if TYPE_CHECKING:
    from .attach.feature import Feature

_registered: list[type] = []
_has_ended = False


def register() -> None:
    if native.load_error() is not None:
        # Properties need the list of methods: without the library only the reason is shown, and Sinew's data
        # in files stays untouched.
        from .ui import sidebar

        _register_classes((sidebar.SINEW_PT_unavailable,))
        return
    from .deform import lifecycle

    # The order of the panels.
    parts, features = _parts(), _features()
    for each in (*parts, *features):
        _register_classes(each.classes)
    for part in parts:
        part.register()
    lifecycle.register()
    for feature in features:
        feature.register()
    lifecycle.adopt_open_file()
    atexit.unregister(_end)
    atexit.register(_end)


def unregister() -> None:
    if _has_ended:
        # Blender as a module unregisters its extensions only after _end().
        return
    if hasattr(bpy.types.Object, "sinew"):
        from .deform import lifecycle

        lifecycle.leave_open_file()
        for feature in reversed(_features()):
            feature.unregister()
        lifecycle.unregister()
        for part in reversed(_parts()):
            part.unregister()
    while _registered:
        bpy.utils.unregister_class(_registered.pop())


def _parts() -> tuple[Feature, ...]:
    """What an object and a character have, with its panel."""
    from .attach import properties, stored_vertex_data
    from .attach.feature import Feature
    from .ui import (
        character,
        character_operators,
        lesson,
        main_panel,
        manual,
        menus,
        meshes_panel,
        modifier_panel,
        operators,
        precomputing,
        preferences,
        presets,
        translations,
    )

    return (
        translations.FEATURE,
        Feature(preferences.CLASSES),
        properties.FEATURE,
        stored_vertex_data.FEATURE,
        character.FEATURE,
        Feature((*operators.CLASSES, *character_operators.CLASSES, *presets.CLASSES, *lesson.CLASSES)),
        precomputing.FEATURE,
        menus.FEATURE,
        manual.FEATURE,
        modifier_panel.FEATURE,
        Feature((*main_panel.CLASSES, *meshes_panel.CLASSES)),
    )


def _features() -> tuple[Feature, ...]:
    names = (
        *("suggest", "action_copy", "inbetween", "blend", "ik", "bake", "corrective", "compare", "heat"),
        *("diagnose", "gltf"),
    )
    return tuple(import_module(f".features.{name}.feature", __package__).FEATURE for name in names)


def _end() -> None:
    """Called at the end of Python. Blender unregisters its extensions before; with bpy as a module nobody
    does, and a Python handler, class or command that is still registered then crashes Blender 4.2 and hangs
    4.5."""
    global _has_ended
    # If Blender has unregistered it, its types are gone by now.
    try:
        if _registered:
            unregister()
    except Exception:
        # What is still registered crashes Blender, so the handlers, at least, go.
        logging.getLogger("sinew").exception("Sinew did not end as it should")
        for functions in map(bpy.app.handlers.__getattribute__, dir(bpy.app.handlers)):
            if isinstance(functions, list):
                functions[:] = [each for each in functions if not each.__module__.startswith(__package__)]
    _has_ended = True
    # Blender 4.2 keeps a reference to each registered property group class, which keeps the names of its
    # module. Blender as a module ends when `bpy` is freed, and crashes if it never is.
    for name, module in list(sys.modules.items()):
        if name == __package__ or name.startswith(f"{__package__}."):
            vars(module).pop("bpy", None)


def _register_classes(classes: tuple[type, ...]) -> None:
    for cls in classes:
        bpy.utils.register_class(cls)
        _registered.append(cls)
