# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's page in Blender's preferences."""

from __future__ import annotations

import os

import bpy

from ..deform import safe_mode, session
from . import menus
from .sidebar import draw_text
from .translations import tr


def _changed(_preferences: SinewPreferences, context: bpy.types.Context) -> None:
    session.refresh(context)


class SinewPreferences(bpy.types.AddonPreferences):
    bl_idname = safe_mode.ADDON

    safe_mode: bpy.props.BoolProperty(
        name="Safe Mode",
        description="Run nothing of Sinew within Blender's own evaluation: meshes are deformed after it, and "
        "Blender evaluates what stands behind once more. Slower; for scenes in which Blender crashes",
        options=set(),
        update=_changed,
    )

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(self, "safe_mode")
        if os.environ.get(safe_mode.VARIABLE) is not None:
            name, value = safe_mode.VARIABLE, repr(os.environ[safe_mode.VARIABLE])
            text = tr("The environment variable {name} decides: it is {value}", name=name, value=value)
            draw_text(self.layout, context, text, icon="INFO")
        menus.draw_shortcuts(self.layout, context)


CLASSES = (SinewPreferences,)
