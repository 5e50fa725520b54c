# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew for Blender: skinning methods to choose from, compared live and computed in native code."""


def register() -> None:
    from . import cli, registration

    registration.register()
    cli.register_command()


def unregister() -> None:
    from . import cli, registration

    cli.unregister_command()
    registration.unregister()


def glTF2_pre_export_callback(export_settings: dict) -> None:  # noqa: N802
    """Blender's glTF exporter calls this before an export."""
    from .deform import exporters

    exporters.before_export(export_settings)


def glTF2_post_export_callback(export_settings: dict) -> None:  # noqa: N802
    """Blender's glTF exporter calls this after an export."""
    from .deform import exporters

    exporters.after_export(export_settings)
