# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the extension's preferences, for all folders."""

from typing import Any

import bpy

ADDON = __package__.rpartition(".")[0]


def value(name: str, default: Any) -> Any:
    """Returns `default` where there are no preferences, as where Sinew is a Python package."""
    preferences = getattr(bpy.context.preferences.addons.get(ADDON), "preferences", None)
    return getattr(preferences, name, default)
