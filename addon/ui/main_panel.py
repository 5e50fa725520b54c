# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab "Sinew" of the 3D view: one set of controls for a character, however many meshes it has."""

from collections.abc import Sequence

import bpy

from ..attach import attach, other_tools, properties, stage_settings
from ..attach.feature import Feature
from ..deform import session
from ..deform.plan import State
from . import character, operators, precomputing, state_text, stepped
from .menus import SINEW_PT_methods
from .presets import SINEW_PT_method_presets
from .settings_layout import draw_method, draw_parameters, draw_stages
from .sidebar import Sidebar, characters, draw_text, names_text, shortened
from .translations import counted, tr

# Characters' widths that a panel's header takes beside its label and what stands on its right.
MARGIN = 4
# The same with two buttons.
BUTTONS = MARGIN + 14


class SINEW_MT_character(bpy.types.Menu):
    bl_label = "Character"
    bl_description = "What one seldom does with a character"

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.operator("sinew.rebind", icon="FILE_REFRESH")
        self.layout.operator("sinew.remove", text="Remove Sinew", icon="X")


class SINEW_PT_main(Sidebar, bpy.types.Panel):
    bl_label = "Sinew"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        # Drawn while the panel is closed, too: finding all meshes takes long in a large scene.
        has_sinew = operators.has_sinew_targets(context)
        layout, meshes = self.layout, character.known_meshes(context) if has_sinew else []
        room = characters() - len(self.bl_label) - (BUTTONS if has_sinew else MARGIN)
        layout.label(text=_title(context, meshes, max(room, 8)), translate=False)
        if has_sinew:
            SINEW_PT_method_presets.draw_panel_header(layout)
            layout.menu(SINEW_MT_character.__name__, text="", icon="DOWNARROW_HLT")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        meshes = operators.targets(context)
        for other in attach.not_meshes(operators.selected(context)):
            draw_text(
                layout,
                "{name} stays with its Armature modifier: Sinew deforms meshes only",
                icon="INFO",
                name=other.name,
            )
        if not meshes:
            draw_text(layout, "Select a mesh that an armature deforms, or the armature", icon="INFO")
            if not operators.selected(context):
                layout.operator("sinew.open_lesson", icon="HELP")
            return
        waits = operators.waits_for_render()
        if waits:
            draw_text(layout, "{wait}: until then nothing can be changed", icon="INFO", wait=tr(waits))
            if not context.scene.render.use_lock_interface:
                text = "Lock Interface, in the menu Render, keeps Blender from reading what a render changes"
                draw_text(layout, text, icon="INFO")
        column = layout.column()
        column.enabled = not waits
        _draw_add(column, meshes)
        skinned = character.find_meshes(context)
        lead = character.lead(context)
        if lead is not None:
            _draw_character(column, context, skinned, lead)


def _title(context: bpy.types.Context, meshes: list[bpy.types.Object], room: int) -> str:
    """Whose settings these are, in so many characters.

    meshes  that have Sinew
    """
    names = [obj.name for obj in operators.armatures(context) or meshes[:1]]
    text = names_text(names, most=2)
    longer = f"{text} \u00b7 {tr('{count} meshes', count=len(meshes))}"
    return longer if len(meshes) > 1 and len(longer) <= room else shortened(text, room)


def _draw_add(layout: bpy.types.UILayout, meshes: list[bpy.types.Object]) -> None:
    count = sum(not properties.has_sinew(obj) for obj in meshes)
    if not count:
        return
    row = layout.row(align=True)
    text = "Add Sinew"
    if len(meshes) > 1:
        text = counted(count, "Add Sinew to {count} Mesh", "Add Sinew to {count} Meshes")
    row.operator("sinew.add", text=text, icon="MOD_ARMATURE")
    row.popover(SINEW_PT_methods.__name__, text="", icon="DOWNARROW_HLT")
    for obj in meshes:
        for sentence in () if properties.has_sinew(obj) else other_tools.warnings(obj):
            draw_text(layout, sentence, icon="ERROR")


def _draw_character(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    meshes: list[bpy.types.Object],
    lead: bpy.types.Object,
) -> None:
    shared = character.of(context.scene)
    # For a single mesh its own settings, which can have keys.
    settings = properties.of(lead) if len(meshes) == 1 else shared
    column = layout.column()
    column.active = shared.enabled
    draw_method(column, settings, SINEW_PT_methods.__name__)
    stepped.draw_progress(layout, "sinew.recommend")
    column = layout.column(align=True)
    column.prop(shared, "enabled", text=state_text.switch_text(meshes), toggle=True)
    row = column.row(align=True)
    # A feature's, which this panel does not know.
    if bpy.ops.sinew.end_comparison.poll():
        row.operator("sinew.end_comparison")
    else:
        row.operator("sinew.compare", text="Compare\u2026")
    row.operator("sinew.contact_sheet", text="", icon="IMGDISPLAY")
    if not stepped.draw_progress(row, "sinew.suggest"):
        row.operator("sinew.suggest", text="Suggest")
    if any(session.plan_of(obj).state is State.REFUSED for obj in meshes):
        layout.operator("sinew.rebind", icon="FILE_REFRESH")
    column = layout.column()
    column.active = shared.enabled
    draw_parameters(column, settings, lead)
    followers = [properties.of(obj) for obj in meshes if not properties.of(obj).is_own]
    methods = {tr(properties.method_label(settings.method)) for settings in followers}
    if len(methods) > 1:
        names = ", ".join(sorted(methods))
        draw_text(
            column,
            "The meshes differ: {names}. A method that you choose goes to all",
            icon="INFO",
            names=names,
        )
    state_text.draw_character(layout, context, meshes)
    precomputing.draw(
        layout, [(obj, session.skinned_of(obj)) for obj in meshes if properties.of(obj).enabled]
    )


def stages_text(names: Sequence[str], room: int) -> str:
    """Stages by their labels or, where these take more than so many characters, by their number."""
    text = ", ".join(tr(stage_settings.STAGES[name].label) for name in names)
    return text if len(text) <= room else counted(len(names), "{count} stage", "{count} stages")


class SINEW_PT_stages(Sidebar, operators.OfSkinned, bpy.types.Panel):
    bl_label = "Stages and Scale"
    bl_parent_id = "SINEW_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        lead = character.lead(context)
        names = [] if lead is None else stage_settings.names_on(properties.of(lead))
        if names:
            room = characters() - len(tr(self.bl_label)) - MARGIN
            self.layout.label(text=stages_text(names, room), translate=False)

    def draw(self, context: bpy.types.Context) -> None:
        lead = character.lead(context)
        if lead is None:
            return
        is_one = len(character.known_meshes(context)) == 1
        settings = properties.of(lead) if is_one else character.of(context.scene)
        layout = self.layout
        layout.enabled = not operators.waits_for_render()
        layout.active = properties.of(lead).enabled
        draw_stages(layout, settings, lead)


FEATURE = Feature((SINEW_MT_character, SINEW_PT_main, SINEW_PT_stages))
