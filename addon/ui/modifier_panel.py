# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows who deforms a mesh, above its stack of modifiers. Blender itself draws the panel of a modifier, and
all meshes share the node group, so these cannot show it."""

import bpy

from ..attach import other_tools, properties
from ..attach.feature import Feature
from ..deform import session
from ..deform.plan import State
from . import state_text
from .sidebar import draw_text

# In the Properties editor, with the stack.
PANEL = "DATA_PT_modifiers"


def _draw(self: bpy.types.Panel, context: bpy.types.Context) -> None:
    obj = context.object
    if obj is None or not properties.has_sinew(obj):
        return
    box = self.layout.box()
    settings, row = properties.of(obj), box.row(align=True)
    row.label(text="Sinew", icon=state_text.icon_of(obj))
    row.prop(settings, "enabled", text=state_text.switch_text([obj]), toggle=True)
    row.operator("sinew.open_tab", text="", icon="MENU_PANEL")
    is_refused = session.plan_of(obj).state is State.REFUSED
    draw_text(box, state_text.sentence_of(obj), alert=is_refused)
    if settings.replaces_modifiers:
        draw_text(box, other_tools.APPLYING, icon="INFO")


FEATURE = Feature(
    begin=lambda: getattr(bpy.types, PANEL).prepend(_draw),
    end=lambda: getattr(bpy.types, PANEL).remove(_draw),
)
