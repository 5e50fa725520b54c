# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers suggestions: a panel and its buttons. Nothing is stored in files."""

from .suggest_panel import CLASSES as CLASSES


def register() -> None:
    pass


def unregister() -> None:
    from .suggest import suggestions

    suggestions.clear()
