# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers Sinew with Blender, and unregisters it."""

from __future__ import annotations

import atexit
import logging
import sys

import bpy

from . import native

_registered: list[type] = []
_has_ended = False


def register() -> None:
    if native.load_error() is not None:
        # Properties need the list of methods: without the library only the reason is shown, and Sinew's data
        # in files stays untouched.
        from .ui import sidebar

        _register_classes((sidebar.SINEW_PT_unavailable,))
        return
    from .attach import properties, stored_vertex_data
    from .deform import exporters, handlers, lifecycle
    from .features.action_copy import feature as action_copy
    from .features.bake import feature as bake
    from .features.blend import feature as blend
    from .features.compare import feature as compare
    from .features.corrective import feature as corrective
    from .features.diagnose import feature as diagnose
    from .features.gltf import feature as gltf
    from .features.heat import feature as heat
    from .features.ik import feature as ik
    from .features.inbetween import feature as inbetween
    from .features.suggest import feature as suggest
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

    # The order of the panels.
    for owner in (
        *(preferences, properties, stored_vertex_data, character, operators, precomputing),
        *(character_operators, presets, lesson, menus, main_panel, meshes_panel),
        *(suggest, action_copy, inbetween, blend, ik, bake, corrective, compare, heat, diagnose, gltf),
    ):
        _register_classes(owner.CLASSES)
    translations.register()
    properties.register()
    stored_vertex_data.register()
    character.register()
    menus.register()
    manual.register()
    modifier_panel.register()
    precomputing.register()
    handlers.register()
    lifecycle.register()
    exporters.register()
    for feature in (suggest, action_copy, compare, heat, diagnose, gltf):
        feature.register()
    lifecycle.adopt_open_file()
    atexit.unregister(_end)
    atexit.register(_end)


def unregister() -> None:
    if _has_ended:
        # Blender as a module unregisters its extensions only after _end().
        return
    if hasattr(bpy.types.Object, "sinew"):
        from .attach import properties, stored_vertex_data
        from .deform import exporters, handlers, lifecycle
        from .features.action_copy import feature as action_copy
        from .features.compare import feature as compare
        from .features.diagnose import feature as diagnose
        from .features.gltf import feature as gltf
        from .features.heat import feature as heat
        from .features.suggest import feature as suggest
        from .ui import (
            character,
            manual,
            menus,
            modifier_panel,
            precomputing,
            translations,
        )

        lifecycle.leave_open_file()
        for feature in (gltf, diagnose, heat, compare, action_copy, suggest):
            feature.unregister()
        exporters.unregister()
        lifecycle.unregister()
        handlers.unregister()
        modifier_panel.unregister()
        manual.unregister()
        menus.unregister()
        precomputing.unregister()
        character.unregister()
        stored_vertex_data.unregister()
        properties.unregister()
        translations.unregister()
    while _registered:
        bpy.utils.unregister_class(_registered.pop())


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
