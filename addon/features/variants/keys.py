# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants by the number keys, while one poses, plays and turns the view; and in a pie menu."""

from collections.abc import Sequence

import bpy

from ...attach import variant_settings
from ...base.errors import SinewError
from ...skinning.variants import Variant
from ...ui import character
from ...ui.operators import OnSinewObjects
from ...ui.translations import tr
from . import choices, stored

NUMBERS = ("ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
# Slots of a pie menu.
MOST_IN_PIE = 8


def number_of(event: bpy.types.Event) -> int | None:
    """Which of the keys 1 to 9 is pressed, from 0 on."""
    is_held = event.ctrl or event.alt or event.shift or event.oskey
    is_number = event.value == "PRESS" and event.type in NUMBERS and not is_held
    return NUMBERS.index(event.type) if is_number else None


def use(variant: Variant) -> None:
    """As a click on it in the panel: one undo step."""
    bpy.ops.sinew.use_variant("EXEC_DEFAULT", True, variant=variant.key)


class SINEW_OT_variant_keys(OnSinewObjects, bpy.types.Operator):
    bl_label = "Variant Keys"
    bl_description = (
        "Until Esc, the keys 1 to 9 in the 3D view use the variants of the character, each one undo step; "
        "all else works as before"
    )
    bl_options = {"REGISTER"}

    # Blender runs it once at most.
    is_on = False

    @classmethod
    def refusal(cls, context: bpy.types.Context) -> str:
        return "They are on: Esc ends them" if cls.is_on else super().refusal(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if context.area is None or context.area.type != "VIEW_3D":
            return self.execute(context)
        self.area = context.area
        SINEW_OT_variant_keys.is_on = True
        self._show(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def run(self, _context: bpy.types.Context) -> None:
        raise SinewError("It listens to keys in a 3D view: press its button there")

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        areas = context.window.screen.areas if context.window is not None else ()
        if self.area not in list(areas):
            SINEW_OT_variant_keys.is_on = False
            return {"CANCELLED", "PASS_THROUGH"}
        if not _is_in(self.area, event):
            return {"PASS_THROUGH"}
        if event.type == "ESC" and event.value == "PRESS":
            self.cancel(context)
            return {"FINISHED"}
        number, variants = number_of(event), choices.of_character(context)
        if number is None or number >= len(variants):
            return {"PASS_THROUGH"}
        if character.lead(context) is None:
            self.report({"WARNING"}, tr(self.refusal(context)))
            return {"RUNNING_MODAL"}
        use(variants[number])
        self._show(context)
        return {"RUNNING_MODAL"}

    def cancel(self, _context: bpy.types.Context) -> None:
        SINEW_OT_variant_keys.is_on = False
        self.area.header_text_set(None)

    def _show(self, context: bpy.types.Context) -> None:
        """Says in the header what the keys do."""
        self.area.header_text_set(header(context, choices.of_character(context)))


def forget() -> None:
    SINEW_OT_variant_keys.is_on = False


def header(context: bpy.types.Context, variants: Sequence[Variant]) -> str:
    """What each key uses, with a mark at what is used."""
    lead = character.lead(context)
    now = variant_settings.read(lead) if lead is not None else None
    texts = []
    for number, each in enumerate(variants[: len(NUMBERS)], start=1):
        mark = "\u25cf " if now is not None and each.agrees_with(now) else ""
        texts.append(f"{number} {mark}{choices.label(each)}")
    return "   ".join([*texts, tr("Esc ends")])


def _is_in(area: bpy.types.Area, event: bpy.types.Event) -> bool:
    x, y = event.mouse_x - area.x, event.mouse_y - area.y
    return 0 <= x < area.width and 0 <= y < area.height


class SINEW_MT_variants_pie(bpy.types.Menu):
    bl_label = "Variants"
    bl_description = "Deform the character by one of its variants"

    def draw(self, context: bpy.types.Context) -> None:
        pie, lead = self.layout.menu_pie(), character.lead(context)
        now = variant_settings.read(lead) if lead is not None else None
        own = stored.of_methods(context)[: MOST_IN_PIE - len(choices.ALWAYS)]
        for each in (*own, *choices.ALWAYS):
            choices.draw_use(pie, each, now)
        if not own:
            pie.operator("sinew.add_variant", text="Add What Is Set Now", icon="ADD")
