# SPDX-License-Identifier: GPL-3.0-or-later
"""The variants that a character is offered: in its panel, by number keys, as rows of a contact sheet."""

from dataclasses import replace

import bpy

from ...attach import variant_settings
from ...skinning.parameters import PRESETS
from ...skinning.variants import BLENDER, USUAL, Variant, parse, parse_list
from ...ui import character
from ...ui.translations import tr
from ..suggest import recommend
from . import stored

AS_BLENDER = Variant.of(BLENDER, name="As Blender")
RECOMMENDED, NOW = "Recommended", "Now"
# Those that every character has.
ALWAYS = (AS_BLENDER, *(parse(name) for name in PRESETS))


def of_character(context: bpy.types.Context) -> list[Variant]:
    """As Blender, what was recommended, and the character's own; without own ones the usual ones. All can be
    used at once."""
    own = stored.of_methods(context)
    return [AS_BLENDER, *_recommended(context), *(own or parse_list(USUAL))]


def _recommended(context: bpy.types.Context) -> list[Variant]:
    choice, lead = recommend.choices.get(context.scene.session_uid), character.lead(context)
    if choice is None or lead is None:
        return []
    method = choice.variant.method
    whole = variant_settings.with_parameters(lead, method, choice.values)
    return [replace(Variant.of_values(method, whole), name=RECOMMENDED)]


def label(variant: Variant) -> str:
    """In the user's language, but for names that the user gave."""
    if variant.name in (AS_BLENDER.name, RECOMMENDED, NOW):
        return tr(variant.name)
    return variant.name or tr(variant.label)


def draw_use(layout: bpy.types.UILayout, variant: Variant, now: Variant | None) -> None:
    """A button that uses it, pressed where it is `now` what is set."""
    is_used = now is not None and variant.agrees_with(now)
    button = layout.operator("sinew.use_variant", text=label(variant), depress=is_used, translate=False)
    button.variant = variant.key
