# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers bakes: an operator."""

from .bake_operator import CLASSES as CLASSES


def register() -> None:
    """Nothing else to register."""


def unregister() -> None:
    """Nothing else to unregister."""
