# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew for Blender: a choice of skinning methods, compared live and computed in native code."""


def register() -> None:
    from . import cli, registration

    registration.register()
    cli.register_command()


def unregister() -> None:
    from . import cli, registration

    cli.unregister_command()
    registration.unregister()


# --- The functions that Blender's glTF exporter calls in an extension


def glTF2_pre_export_callback(export_settings: dict) -> None:  # noqa: N802
    """Called before an export."""
    from .features.gltf import feature

    feature.before_export(export_settings)


def glTF2ExportUserExtension() -> object:  # noqa: N802
    """Blender takes this function for a class, and calls the returned object's functions during an export."""
    from .features.gltf import export

    return export.GltfExtension()


def draw_export(context: object, layout: object) -> None:
    """Called to draw in the exporter's sidebar."""
    from .features.gltf import feature

    feature.draw(context, layout)
