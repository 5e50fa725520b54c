# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew in Blender's menus, where F3 finds it, a pie menu, and shortcuts."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, groupby
from pathlib import Path
from typing import ClassVar

import bpy
import bpy.utils.previews
import rna_keymap_ui
import sinew

from ..attach import properties
from ..attach.feature import Feature
from ..skinning.engines import ENGINE_GROUP, Engine
from . import character, operators
from .stepped import OVER

# One elbow under each method (tools/pictures/draw_sheets.py), and its height in lines of a menu.
PICTURES, PICTURE_HEIGHT = Path(__file__).with_name("pictures"), 3.0
# Holds what Blender loads of them; empty without a window.
_pictures: list[bpy.utils.previews.ImagePreviewCollection] = []


@dataclass(frozen=True)
class Entry:
    """An operator in a menu.

    text    empty: the operator's own label
    values  of the operator's properties
    """

    operator: str
    text: str = ""
    icon: str = "NONE"
    values: dict[str, str | bool] = field(default_factory=dict)


def _over(operator: str, text: str) -> tuple[Entry, ...]:
    """Returns an entry for each range of frames."""
    return tuple(
        Entry(operator, f"{text} over the {label}", values={"over": name}) for name, label, _text in OVER
    )


class SINEW_MT_methods(bpy.types.Menu):
    bl_label = "Method"
    bl_description = "How the bones' motions are blended, for all meshes of the character"

    def draw(self, context: bpy.types.Context) -> None:
        _draw_recommended(context, self.layout)
        for group, methods in _groups():
            self.layout.label(text=group)
            for method in methods:
                _draw_method(context, self.layout, method)


class SINEW_PT_methods(bpy.types.Panel):
    """The same with pictures, which a menu would not put beside names, in two columns."""

    bl_label = "Method"
    bl_description = SINEW_MT_methods.bl_description
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options: ClassVar[set[str]] = {"INSTANCED"}
    bl_ui_units_x = 25

    def draw(self, context: bpy.types.Context) -> None:
        _draw_recommended(context, self.layout)
        row = self.layout.row()
        columns, height = (row.column(), row.column()), 0.0
        half = sum(_height(*each) for each in _groups()) / 2.0
        for group, methods in _groups():
            column = columns[height >= half]
            height += _height(group, methods)
            column.label(text=group)
            for method in methods:
                if group == ENGINE_GROUP:
                    _draw_method(context, column, method)
                    continue
                split = column.split(factor=0.28)
                split.template_icon(_pictures[0][method.name].icon_id, scale=PICTURE_HEIGHT)
                name = split.column()
                name.scale_y = PICTURE_HEIGHT
                _draw_method(context, name, method)


def _groups() -> list[tuple[str, list[sinew.Method | Engine]]]:
    methods = properties.METHODS.values()
    return [(group, list(each)) for group, each in groupby(methods, lambda method: method.group)]


def _height(group: str, methods: Sequence[sinew.Method | Engine]) -> float:
    """Of a group with its pictures, in lines; what engines show has none."""
    return 1.0 + len(methods) * (1.0 if group == ENGINE_GROUP else PICTURE_HEIGHT)


def _draw_recommended(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    if character.lead(context) is None:
        layout.operator("sinew.add", text="Recommended", icon="SOLO_ON").method = operators.RECOMMENDED
        return
    # From a menu, too, in steps.
    row = layout.row()
    row.operator_context = "INVOKE_DEFAULT"
    row.operator("sinew.recommend", icon="SOLO_ON")


def _draw_method(
    context: bpy.types.Context, layout: bpy.types.UILayout, method: sinew.Method | Engine
) -> None:
    lead = character.lead(context)
    operator = "sinew.add" if lead is None else "sinew.use_method"
    is_used = lead is not None and properties.of(lead).method == method.name
    layout.operator(operator, text=method.label, depress=is_used).method = method.name


def _draw_entries(layout: bpy.types.UILayout, entries: Iterable[Entry]) -> None:
    # Outside of a sidebar, a menu would execute without the dialog.
    layout.operator_context = "INVOKE_DEFAULT"
    for entry in entries:
        text = {"text": entry.text} if entry.text else {}
        button = layout.operator(entry.operator, icon=entry.icon, **text)
        for name, value in entry.values.items():
            setattr(button, name, value)


class _Submenu:
    """A menu of operators that act on the selection."""

    entries: ClassVar[tuple[Entry, ...]]

    def draw(self, _context: bpy.types.Context) -> None:
        _draw_entries(self.layout, self.entries)


class SINEW_MT_stages(_Submenu, bpy.types.Menu):
    bl_label = "Stages and Settings"
    bl_description = "What follows the method, and whose settings count"
    entries = (
        Entry("sinew.own_settings", "Own Settings of This Mesh"),
        Entry("sinew.take_over_smooth", icon="MOD_SMOOTH"),
        *_over("sinew.auto_mix", "Auto-Mix"),
        Entry("sinew.make_group", "Make Vertex Group of the Mix", values={"stage": "mix"}),
        Entry("sinew.make_group", "Make Vertex Group of Limit Bulge", values={"stage": "bulge_limit"}),
        Entry("sinew.make_group", "Make Vertex Group of Delta Mush", values={"stage": "delta_mush"}),
        Entry("sinew.add_variant"),
        Entry("sinew.variant_keys"),
        Entry("sinew.method_preset_add", "Save Method as Preset\u2026"),
    )


class SINEW_MT_compare(_Submenu, bpy.types.Menu):
    bl_label = "Compare"
    bl_description = "Methods beside each other, and which one suits the character"
    entries = (
        Entry("sinew.compare", "Compare Methods\u2026", icon="MOD_ARRAY"),
        Entry("sinew.contact_sheet", icon="IMGDISPLAY"),
        Entry("sinew.save_contact_sheet", "Save Sheet as Page\u2026", icon="URL"),
        Entry("sinew.flip_comparison"),
        Entry("sinew.save_comparison", "Save as Page\u2026", icon="URL"),
        Entry("sinew.end_comparison"),
        Entry("sinew.recommend", icon="SOLO_ON"),
        *_over("sinew.suggest", "Suggest a Method"),
        Entry("sinew.motion_range", icon="ARMATURE_DATA"),
        Entry("sinew.end_motion_range"),
        Entry("sinew.flex", "Flex: Bend Every Joint"),
        Entry("sinew.save_flex", "Save Flex as Page\u2026", icon="URL"),
    )


class SINEW_MT_heat(_Submenu, bpy.types.Menu):
    bl_label = "Heat Map"
    bl_description = "A measure of the deformation as colours, and where it is worst"
    entries = (
        Entry("sinew.heat_map", icon="SHADING_RENDERED"),
        Entry("sinew.heat_map", "Heat Map of Bake Error", values={"quantity": "bake_error"}),
        *_over("sinew.worst_frames", "Find Worst Frames"),
        *_over("sinew.fit_heat_range", "Fit Heat Map"),
    )


class SINEW_MT_diagnostics(_Submenu, bpy.types.Menu):
    bl_label = "Diagnostics"
    bl_description = "Faults of weights and poses"
    entries = (Entry("sinew.check", "Check Weights and Pose"), *_over("sinew.check_frames", "Check"))


class SINEW_MT_animation(_Submenu, bpy.types.Menu):
    bl_label = "Animation"
    bl_description = "In-betweens and blends of actions"
    entries = (
        Entry("sinew.bake_inbetweens", "Bake In-betweens\u2026"),
        Entry("sinew.blend_actions", "Blend Actions\u2026"),
        Entry("sinew.original_action"),
    )


class SINEW_MT_bake(_Submenu, bpy.types.Menu):
    bl_label = "Bake"
    bl_description = "Shapes as data that plays without Sinew"
    entries = (
        Entry("sinew.bake", "Bake Shapes\u2026", icon="RENDER_ANIMATION"),
        Entry("sinew.export", "Export for Engines\u2026", icon="EXPORT"),
        Entry("sinew.corrective_key", icon="SHAPEKEY_DATA"),
        Entry("sinew.corrective_key", "Corrective Shape Key Driven by the Bone", values={"driven": True}),
    )


SUBMENUS = (
    SINEW_MT_stages,
    SINEW_MT_compare,
    SINEW_MT_heat,
    SINEW_MT_diagnostics,
    SINEW_MT_animation,
    SINEW_MT_bake,
)


class SINEW_MT_menu(bpy.types.Menu):
    bl_label = "Sinew"
    bl_description = "Skinning of the selected character"
    first = (Entry("sinew.add", icon="MOD_ARMATURE"),)
    then = (
        Entry("sinew.switch"),
        Entry("sinew.rebind", icon="FILE_REFRESH"),
        Entry("sinew.remove", "Remove Sinew", icon="X"),
    )
    last = (Entry("sinew.open_tab"), Entry("sinew.open_lesson", icon="HELP"))

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        _draw_entries(layout, self.first)
        layout.menu(SINEW_MT_methods.__name__)
        _draw_entries(layout, self.then)
        layout.separator()
        for menu in SUBMENUS:
            layout.menu(menu.__name__)
        layout.separator()
        _draw_entries(layout, self.last)


def entries() -> Iterator[Entry]:
    """Those of the menu and its submenus, but methods: all operators that act on the selection, and the
    lesson."""
    menu = SINEW_MT_menu
    yield from (*menu.first, *menu.then, *chain(*(each.entries for each in SUBMENUS)), *menu.last)


# Of features/variants.
VARIANTS_PIE = "SINEW_MT_variants_pie"


class SINEW_MT_pie(bpy.types.Menu):
    bl_label = "Sinew"
    bl_description = "What one does most often while posing"

    def draw(self, context: bpy.types.Context) -> None:
        pie = self.layout.menu_pie()
        pie.operator("sinew.flip_comparison", icon="UV_SYNC_SELECT")
        pie.menu(SINEW_MT_methods.__name__, icon="MOD_ARMATURE")
        if operators.has_sinew_targets(context):
            pie.operator("sinew.switch", icon="HIDE_OFF")
        else:
            pie.operator("sinew.add", icon="ADD")
        pie.operator("sinew.compare", text="Compare\u2026", icon="MOD_ARRAY")
        pie.operator("sinew.heat_map", icon="SHADING_RENDERED")
        pie.operator("sinew.check", icon="CHECKMARK")
        pie.operator("sinew.open_tab", icon="MENU_PANEL")
        # The variants' own pie, below features.
        pie.operator("wm.call_menu_pie", text="Variants", icon="LINENUMBERS_ON").name = VARIANTS_PIE


def _draw_in_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.menu(SINEW_MT_menu.__name__)


def _draw_in_modifiers(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.operator("sinew.add", text="Sinew", icon="MOD_ARMATURE")


def _draw_in_help(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("sinew.open_lesson", text="Sinew Lesson", icon="HELP")


MENUS = {
    "TOPBAR_MT_help": _draw_in_help,
    "VIEW3D_MT_object": _draw_in_menu,
    "VIEW3D_MT_pose": _draw_in_menu,
    # F3 searches those of the current mode. Texture Paint has none.
    "VIEW3D_MT_edit_mesh": _draw_in_menu,
    "VIEW3D_MT_edit_armature": _draw_in_menu,
    "VIEW3D_MT_sculpt": _draw_in_menu,
    "VIEW3D_MT_paint_weight": _draw_in_menu,
    "VIEW3D_MT_paint_vertex": _draw_in_menu,
    "OBJECT_MT_modifier_add_deform": _draw_in_modifiers,
}
# The operator, what it opens, and its key, with Alt and Shift: Blender does not use these in a 3D view.
SHORTCUTS = (("wm.call_menu_pie", SINEW_MT_pie.__name__, "Y"), ("sinew.flip_comparison", "", "F"))
# What was added to the add-ons' key configuration.
_shortcuts: list[tuple[bpy.types.KeyMap, bpy.types.KeyMapItem]] = []


def draw_shortcuts(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draws the shortcuts in the preferences, where they can be changed; they are in the user's key
    configuration."""
    user = context.window_manager.keyconfigs.user
    if user is None or not _shortcuts:
        return
    layout.label(text="Shortcuts in the 3D View")
    keymap = user.keymaps.get(_shortcuts[0][0].name)
    for operator, menu, _key in SHORTCUTS if keymap is not None else ():
        for item in keymap.keymap_items:
            if item.idname == operator and (not menu or item.properties.name == menu):
                layout.context_pointer_set("keymap", keymap)
                rna_keymap_ui.draw_kmi([], user, keymap, item, layout, 0)


def _begin() -> None:
    if not bpy.app.background:
        _pictures.append(bpy.utils.previews.new())
        for picture in PICTURES.glob("*.png"):
            _pictures[0].load(picture.stem, str(picture), "IMAGE")
    addons = bpy.context.window_manager.keyconfigs.addon
    if addons is None:
        # In background mode.
        return
    keymap = addons.keymaps.new(name="3D View Generic", space_type="VIEW_3D")
    for operator, menu, key in SHORTCUTS:
        item = keymap.keymap_items.new(operator, key, "PRESS", alt=True, shift=True)
        if menu:
            item.properties.name = menu
        _shortcuts.append((keymap, item))


def _end() -> None:
    while _pictures:
        bpy.utils.previews.remove(_pictures.pop())
    while _shortcuts:
        keymap, item = _shortcuts.pop()
        keymap.keymap_items.remove(item)


FEATURE = Feature(
    (SINEW_MT_methods, SINEW_PT_methods, *SUBMENUS, SINEW_MT_menu, SINEW_MT_pie),
    menus=MENUS,
    begin=_begin,
    end=_end,
)
