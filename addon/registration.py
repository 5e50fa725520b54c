# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers Sinew with Blender, and unregisters it."""

from __future__ import annotations

import atexit
import logging
import sys
from contextlib import ExitStack
from importlib import import_module
from typing import TYPE_CHECKING

import bpy

from . import native

if TYPE_CHECKING:
    from .attach.feature import Feature

_to_undo = ExitStack()


def register() -> None:
    """Takes back what it did if it fails."""
    global _to_undo
    atexit.unregister(_end)
    atexit.register(_end)
    with ExitStack() as steps:
        if native.load_error() is None:
            _register_all(steps)
        else:
            # Properties need the list of methods: without the library only the reason is shown, and Sinew's
            # data in files stays untouched.
            from .ui import sidebar

            _register_class(steps, sidebar.SINEW_PT_unavailable)
        _to_undo = steps.pop_all()


def unregister() -> None:
    _to_undo.close()


def _register_all(steps: ExitStack) -> None:
    from .deform import lifecycle

    # The order of the panels.
    parts, features = _parts(), _features()
    for each in (*parts, *features):
        for cls in each.classes:
            _register_class(steps, cls)
    for each in (*parts, lifecycle.FEATURE, *features):
        each.register()
        steps.callback(each.unregister)
    steps.callback(lifecycle.leave_open_file)
    lifecycle.adopt_open_file()


def _register_class(steps: ExitStack, cls: type) -> None:
    bpy.utils.register_class(cls)
    steps.callback(bpy.utils.unregister_class, cls)


def _parts() -> tuple[Feature, ...]:
    """What an object and a character have, with its panel."""
    names = (
        "ui.translations ui.preferences attach.properties attach.stored_vertex_data ui.character "
        "ui.operators ui.character_operators ui.presets ui.lesson ui.precomputing ui.menus ui.manual "
        "ui.modifier_panel ui.main_panel ui.meshes_panel"
    )
    return tuple(import_module(f".{name}", __package__).FEATURE for name in names.split())


def _features() -> tuple[Feature, ...]:
    names = (
        "variants suggest action_copy inbetween blend corrective compare motion_range contact_sheet flex "
        "heat auto_mix diagnose bake gltf"
    )
    return tuple(import_module(f".features.{name}.feature", __package__).FEATURE for name in names.split())


def _end() -> None:
    """Called at the end of Python. Blender unregisters its extensions before; with bpy as a module nobody
    does, and a Python handler, class or command that is still registered then crashes Blender 4.2 and hangs
    4.5."""
    # If Blender has unregistered it, its types are gone by now, and nothing is left to undo.
    try:
        unregister()
    except Exception:
        # What is still registered crashes Blender, so the handlers, at least, go.
        logging.getLogger("sinew").exception("Sinew did not end as it should")
        for functions in map(bpy.app.handlers.__getattribute__, dir(bpy.app.handlers)):
            if isinstance(functions, list):
                functions[:] = [each for each in functions if not each.__module__.startswith(__package__)]
    # Blender 4.2 keeps a reference to each registered property group class, which keeps the names of its
    # module. Blender as a module ends when `bpy` is freed, and crashes if it never is.
    for name, module in list(sys.modules.items()):
        if name == __package__ or name.startswith(f"{__package__}."):
            vars(module).pop("bpy", None)
