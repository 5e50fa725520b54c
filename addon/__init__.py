# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew for Blender: skinning methods to choose from, compared live and computed in native code."""


def register() -> None:
    from . import cli
    from .blender import registration

    registration.register()
    cli.register_command()


def unregister() -> None:
    from . import cli
    from .blender import registration

    cli.unregister_command()
    registration.unregister()
