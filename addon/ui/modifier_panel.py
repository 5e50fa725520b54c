# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows who deforms a mesh, above its stack of modifiers. Blender itself draws the panel of a modifier, and
all meshes share the node group, so these cannot show it. What is drawn here keeps its height whatever Sinew
does: the icons of the stack stay under the mouse."""

import bpy

from ..attach import layout as layouts
from ..attach import properties
from ..attach.feature import Feature
from ..deform import session
from ..deform.plan import State
from . import state_text
from .translations import tr

# In the Properties editor, with the stack.
PANEL = "DATA_PT_modifiers"
# Points of width below which Blender leaves out the names of modifiers (seen on 4.2 to 5.2).
NAMES_FROM = 300


def _draw(self: bpy.types.Panel, context: bpy.types.Context) -> None:
    obj = context.object
    if obj is None or not properties.has_sinew(obj):
        return
    column = self.layout.column(align=True)
    row = column.row(align=True)
    row.alert = session.plan_of(obj).state is State.REFUSED
    text = f"Sinew: {tr(state_text.switch_text([obj]))}"
    icon = state_text.icon_of(obj)
    row.prop(properties.of(obj), "enabled", text=text, icon=icon, toggle=True, translate=False)
    # Its tooltip has the whole sentence.
    row.operator("sinew.open_tab", text="", icon="MENU_PANEL")
    if context.region.width / context.preferences.system.ui_scale < NAMES_FROM:
        _draw_own(column.row(), obj)


def _draw_own(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draws what Sinew's modifiers are for, each with its icon, in the order of the stack."""
    now = layouts.read(obj)
    for name, text, icon in (
        (now.mark, "Ahead", "GEOMETRY_NODES"),
        (now.sinew, "Skin", "GEOMETRY_NODES"),
        (now.neutral, "Behind", "MOD_MESHDEFORM"),
    ):
        if name:
            layout.label(text=text, icon=icon)


FEATURE = Feature(
    begin=lambda: getattr(bpy.types, PANEL).prepend(_draw),
    end=lambda: getattr(bpy.types, PANEL).remove(_draw),
)
