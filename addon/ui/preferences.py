# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's preferences."""

from __future__ import annotations

import os

import bpy

from ..attach.feature import Feature
from ..attach.subscribers import notify, subscribers
from ..deform import precomputing, safe_mode, session
from ..io import addon_preferences
from . import menus, operators
from .sidebar import draw_text
from .translations import tr


def _safe_mode_changed(_preferences: SinewPreferences, context: bpy.types.Context) -> None:
    session.refresh(context)
    notify(subscribers.safe_mode_changed)


def _cache_changed(_preferences: SinewPreferences, _context: bpy.types.Context) -> None:
    precomputing.open_cache()


class SinewPreferences(bpy.types.AddonPreferences):
    bl_idname = addon_preferences.ADDON

    first_method: bpy.props.EnumProperty(
        name="Add Sinew With",
        description="The method that a click on Add Sinew starts with",
        items=operators.FIRST_METHODS,
        default=operators.AS_BEFORE,
        options=set(),
    )
    cache_folder: bpy.props.StringProperty(
        name="Cache Folder",
        description="Where numbers of vertices are kept that methods take long to compute; empty: the "
        "extension's own folder",
        subtype="DIR_PATH",
        options=set(),
        update=_cache_changed,
    )
    safe_mode: bpy.props.BoolProperty(
        name="Safe Mode",
        description="Run nothing of Sinew within Blender's own evaluation: meshes are deformed after it, and "
        "Blender evaluates what stands behind once more. Slower; for scenes in which Blender crashes",
        options=set(),
        update=_safe_mode_changed,
    )

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout.column()
        layout.use_property_split = True
        layout.prop(self, "first_method")
        layout.prop(self, "cache_folder")
        _draw_variable(layout, precomputing.VARIABLE)
        layout.prop(self, "safe_mode")
        _draw_variable(layout, safe_mode.VARIABLE)
        layout.prop(
            context.scene.render, "use_lock_interface", text="Lock Interface in Renders of This Scene"
        )
        menus.draw_shortcuts(self.layout, context)


def _draw_variable(layout: bpy.types.UILayout, name: str) -> None:
    """Draws a note where an environment variable overrides the setting."""
    if os.environ.get(name) is not None:
        text = tr(
            "The environment variable {name} decides: it is {value}", name=name, value=repr(os.environ[name])
        )
        draw_text(layout, text, icon="INFO")


FEATURE = Feature((SinewPreferences,))
