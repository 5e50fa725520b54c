# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers Sinew with Blender, and takes all of it out again."""

from __future__ import annotations

import atexit

import bpy

from . import native

_registered: list[type] = []


def register() -> None:
    if native.load_error() is not None:
        # Properties would need the table of methods: without the library only the reason is shown, and what
        # a file holds of Sinew stays in it untouched.
        from .ui import sidebar

        _register_classes((sidebar.SINEW_PT_unavailable,))
        return
    from .attach import properties
    from .deform import exporters, handlers
    from .features.bake import bake_operator
    from .features.compare import comparison_labels, comparison_operators, comparison_panel, comparison_state
    from .features.diagnose import diagnostics_panel
    from .features.heat import heat_panel, measures
    from .features.heat import subscription as heat
    from .features.inbetween import inbetween_handlers, inbetween_panel
    from .ui import main_panel, operators, preferences

    _register_classes(
        (
            *preferences.CLASSES,
            *properties.CLASSES,
            *measures.CLASSES,
            *operators.CLASSES,
            *main_panel.CLASSES,
        )
    )
    _register_classes((*inbetween_panel.CLASSES, *bake_operator.CLASSES))
    _register_classes((*comparison_state.CLASSES, *comparison_operators.CLASSES, *comparison_panel.CLASSES))
    _register_classes((*heat_panel.CLASSES, *diagnostics_panel.CLASSES))
    bpy.types.Scene.sinew_comparison = bpy.props.PointerProperty(type=comparison_state.SinewComparison)
    comparison_labels.register()
    bpy.types.Object.sinew = bpy.props.PointerProperty(
        type=properties.SinewSettings, override=properties.OVERRIDABLE
    )
    bpy.types.Mesh.sinew_asked = properties.MESH_REQUEST
    bpy.types.Action.sinew_holds = bpy.props.CollectionProperty(type=properties.SinewActionHold)
    for name, choice in properties.INBETWEEN.items():
        setattr(bpy.types.Object, name, choice)
    # Poses come before what they deform.
    inbetween_handlers.register()
    inbetween_handlers.adopt_open_file()
    handlers.register()
    heat.register()
    exporters.register()
    diagnostics_panel.register()
    handlers.adopt_open_file()
    # Blender unregisters its extensions before it ends; with bpy as a module nobody does, and a Python
    # handler, class or command that is still registered then crashes Blender 4.2 and hangs 4.5.
    atexit.register(unregister)


def unregister() -> None:
    if hasattr(bpy.types.Object, "sinew"):
        from .attach import note, properties
        from .deform import exporters, handlers, session
        from .features.compare import comparison_labels
        from .features.diagnose import diagnostics_panel
        from .features.heat import subscription as heat
        from .features.inbetween import inbetween_handlers

        atexit.unregister(unregister)
        comparison_labels.unregister()
        diagnostics_panel.unregister()
        # As in a saved file: the Armature modifiers deform.
        session.prepare_for_save()
        note.remove()
        exporters.unregister()
        heat.unregister()
        handlers.unregister()
        inbetween_handlers.unregister()
        del bpy.types.Object.sinew, bpy.types.Mesh.sinew_asked, bpy.types.Action.sinew_holds
        del bpy.types.Scene.sinew_comparison
        for name in properties.INBETWEEN:
            delattr(bpy.types.Object, name)
    while _registered:
        bpy.utils.unregister_class(_registered.pop())


def _register_classes(classes: tuple[type, ...]) -> None:
    for cls in classes:
        bpy.utils.register_class(cls)
        _registered.append(cls)
