# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender gets of bakes: an operator."""

from .bake_operator import CLASSES as CLASSES


def register() -> None:
    """Nothing besides."""


def unregister() -> None:
    """Nothing besides."""
