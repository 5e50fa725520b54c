# SPDX-License-Identifier: GPL-3.0-or-later
"""Safe mode: nothing of Sinew runs within Blender's evaluation, on threads of Blender's."""

from __future__ import annotations

import os

import bpy

VARIABLE = "SINEW_SAFE"
ADDON = __package__.rpartition(".")[0]

_forced: bool | None = None


def is_on() -> bool:
    """By set_forced(), else the environment, else the preference."""
    if _forced is not None:
        return _forced
    wanted = os.environ.get(VARIABLE)
    if wanted is not None:
        return wanted not in ("", "0")
    preferences = getattr(bpy.context.preferences.addons.get(ADDON), "preferences", None)
    return preferences is not None and preferences.safe_mode


def set_forced(on: bool | None) -> None:
    """Whatever the environment and the preference say; None: as they say. Takes effect with the next
    evaluation of an object that changed, or with session.refresh()."""
    global _forced
    _forced = on
