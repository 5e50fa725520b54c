# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers bakes: operators, and the panel of their errors."""

from . import bake_operator, error_panel

CLASSES = (*bake_operator.CLASSES, *error_panel.CLASSES)


def register() -> None:
    """Nothing else to register."""


def unregister() -> None:
    """Nothing else to unregister."""
