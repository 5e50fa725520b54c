# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew for Blender: skinning methods to choose from, compared live and computed in native code."""


def register() -> None:
    from .blender import registration

    registration.register()


def unregister() -> None:
    from .blender import registration

    registration.unregister()
