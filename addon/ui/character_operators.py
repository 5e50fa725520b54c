# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that act on a character's settings."""

import contextlib

import bpy

from ..attach import other_tools, properties
from ..attach.feature import Feature
from ..base.errors import SinewError
from ..deform import session
from . import character, state_text
from .operators import Named, OnSinewObjects, active_object, sinew_targets
from .sidebar import Sidebar
from .translations import tip, tr


class SINEW_OT_use_method(OnSinewObjects, bpy.types.Operator):
    bl_label = "Use Method"
    bl_description = "Deform all meshes of the character by this method"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    method: bpy.props.StringProperty(name="Method", description="Its short name, as in the table of methods")

    @classmethod
    def description(cls, _context: bpy.types.Context, given: bpy.types.OperatorProperties) -> str:
        method = properties.METHODS.get(given.method)
        return tip(cls.bl_description if method is None else method.description)

    def run(self, context: bpy.types.Context) -> None:
        if self.method not in properties.METHODS:
            names = ", ".join(properties.METHODS)
            raise SinewError(tr("Method {name}: choose one of {names}", name=repr(self.method), names=names))
        character.set_method(context, self.method)


class SINEW_OT_switch(OnSinewObjects, bpy.types.Operator):
    bl_label = "Switch On / Off"
    bl_description = (
        "Flip all meshes of the character between Sinew and Blender's Armature modifier, to compare the two"
    )

    def run(self, context: bpy.types.Context) -> None:
        shared = character.of(context.scene)
        shared.enabled = not shared.enabled
        self.report({"INFO"}, "Sinew is on" if shared.enabled else "Sinew is off")


class SINEW_OT_own_settings(OnSinewObjects, bpy.types.Operator):
    bl_label = "Own Settings"
    bl_description = (
        "Let this mesh differ: it keeps settings of its own, which can have keys, and the character's do not "
        "change it. Once more: it follows the character again"
    )

    name: bpy.props.StringProperty(
        name="Mesh", description="Empty: the active one", options={"HIDDEN", "SKIP_SAVE"}
    )

    def run(self, context: bpy.types.Context) -> None:
        active = active_object(context)
        name = self.name or (active.name if active is not None else "")
        obj = next((o for o in sinew_targets(context) if o.name == name), None)
        if obj is None:
            name = name or tr("The active object")
            raise SinewError(tr("{name} is no mesh that Sinew deforms", name=name))
        settings = properties.of(obj)
        settings.is_own = not settings.is_own
        others = [other for other in character.followers(context) if other != obj]
        if not settings.is_own and others:
            with session.changing(context):
                properties.share(others[0], obj)


class SINEW_OT_open_tab(Named, bpy.types.Operator):
    bl_label = "Open the Sinew Tab"
    bl_description = "Show the tab Sinew in the sidebar of the 3D view"
    bl_options = {"REGISTER"}

    @classmethod
    def description(cls, context: bpy.types.Context, _values: bpy.types.OperatorProperties) -> str:
        """Beside the modifiers of a mesh, also says who deforms it."""
        obj, text = context.object, tip(cls.bl_description)
        if context.area is None or context.area.type != "PROPERTIES" or not properties.has_sinew(obj):
            return text
        return ". ".join((state_text.sentence_of(obj), tr(other_tools.APPLYING), text))

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "This window has no 3D view" if _view3d(context) is None else ""

    def run(self, context: bpy.types.Context) -> None:
        area = _view3d(context)
        area.spaces.active.show_region_ui = True
        if not bpy.app.background:
            address = area.as_pointer()
            # A sidebar that was closed has no tabs before it is drawn.
            for seconds in (0.0, 0.1):
                bpy.app.timers.register(lambda: _choose_tab(address), first_interval=seconds)


def _choose_tab(address: int) -> None:
    """address: of the area, which may be closed by now."""
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    for area in areas:
        if area.as_pointer() == address and area.type == "VIEW_3D":
            region = next(region for region in area.regions if region.type == "UI")
            # Fails if the region shows no tabs.
            with contextlib.suppress(TypeError, AttributeError):
                region.active_panel_category = Sidebar.bl_category
            region.tag_redraw()


def _view3d(context: bpy.types.Context) -> bpy.types.Area | None:
    if context.area is not None and context.area.type == "VIEW_3D":
        return context.area
    areas = [] if context.screen is None else [a for a in context.screen.areas if a.type == "VIEW_3D"]
    return max(areas, key=lambda area: area.width * area.height, default=None)


FEATURE = Feature((SINEW_OT_use_method, SINEW_OT_switch, SINEW_OT_own_settings, SINEW_OT_open_tab))
