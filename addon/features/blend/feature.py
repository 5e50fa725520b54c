# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers blends of actions: classes, and the settings of an armature object."""

from __future__ import annotations

from . import blend_panel, blend_settings

CLASSES = (*blend_settings.CLASSES, *blend_panel.CLASSES)


def register() -> None:
    blend_settings.register()


def unregister() -> None:
    blend_settings.unregister()
