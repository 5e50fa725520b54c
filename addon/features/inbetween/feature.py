# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers in-betweens: classes, properties, handlers."""

from __future__ import annotations

import bpy

from ...io import actions
from . import inbetween, inbetween_handlers, inbetween_panel

CLASSES = (actions.SinewActionHold, *inbetween_panel.CLASSES)


def register() -> None:
    bpy.types.Action.sinew_holds = bpy.props.CollectionProperty(type=actions.SinewActionHold)
    inbetween.register()
    inbetween_handlers.register()
    inbetween_handlers.adopt_open_file()


def unregister() -> None:
    inbetween_handlers.unregister()
    inbetween.unregister()
    del bpy.types.Action.sinew_holds
