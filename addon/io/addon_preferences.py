# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension's page in Blender's preferences says, for all rooms that ask."""

from __future__ import annotations

from typing import Any

import bpy

ADDON = __package__.rpartition(".")[0]


def value(name: str, default: Any) -> Any:
    """`default` where there is no such page, as where Sinew is a package of Python's."""
    preferences = getattr(bpy.context.preferences.addons.get(ADDON), "preferences", None)
    return getattr(preferences, name, default)
