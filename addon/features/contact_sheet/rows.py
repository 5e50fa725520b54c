# SPDX-License-Identifier: GPL-3.0-or-later
"""The variants that a character's contact sheet shows, and its joints."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import bpy

from ...attach import properties, property_groups, variant_settings
from ...base.errors import SinewError
from ...deform import session
from ...skinning.variants import BLENDER, FILE, WHOLE, Variant, named, parse_list
from ...ui import character
from ...ui.operators import armatures, sinew_targets
from ...ui.sidebar import names_text
from ..pages.contact_sheet import Bent, columns, headings
from ..pages.sheet import Sheet
from ..variants import choices


def rows(context: bpy.types.Context, text: str) -> list[Variant]:
    """Returns what the character can be deformed by at once.

    text  variants that commas divide; empty: those that it is offered, with what is set now. Raises WrongUse
    """
    lead = character.lead(context)
    assert lead is not None, "the operator's refusal() says so"
    now = variant_settings.read(lead)
    found = parse_list(text) if text.strip() else choices.of_character(context)
    for each in found:
        if each.method in WHOLE and each.method not in (BLENDER, FILE):
            raise SinewError(f"{each.method}: choose it for the character first, it is then a row")
    found = [now if each.method == FILE else each for each in found]
    if not text.strip() and not any(each.agrees_with(now) for each in found):
        found.insert(1, named(now, choices.NOW))
    return found


def of_meshes(
    context: bpy.types.Context, variants: Sequence[Variant]
) -> list[Mapping[bpy.types.Object, Variant]]:
    """Returns of each row what it makes of the character's meshes: those with settings of their own keep
    them."""
    meshes, followers = sinew_targets(context), character.followers(context)
    own = {obj: variant_settings.read(obj) for obj in meshes}
    return [own | dict.fromkeys(followers, each) for each in variants]


def joints(context: bpy.types.Context) -> list[Bent]:
    """Returns the columns. Raises SinewError where nothing bends."""
    meshes = sinew_targets(context)
    if any(obj.mode == "EDIT" for obj in meshes):
        raise SinewError("Leave edit mode first")
    with switched_on(context):
        return columns(meshes)


def sheet(
    context: bpy.types.Context,
    variants: Sequence[Variant],
    bent: Sequence[Bent],
    is_difference: bool = False,
) -> Sheet:
    """Returns one without pictures."""
    title, labels = names_text([obj.name for obj in armatures(context)]), list(map(choices.label, variants))
    return Sheet(title, labels, headings(bent), is_difference=is_difference)


@contextmanager
def switched_on(context: bpy.types.Context) -> Iterator[None]:
    """Context in which Sinew deforms all meshes that follow the character; what is off has nothing to
    measure."""
    off = [obj for obj in character.followers(context) if not properties.of(obj).enabled]
    try:
        _switch(context, off, True)
        yield
    finally:
        _switch(context, off, False)


def _switch(context: bpy.types.Context, objects: Sequence[bpy.types.Object], on: bool) -> None:
    if not objects:
        return
    with session.changing(context):
        for obj in objects:
            property_groups.assign(properties.of(obj), "enabled", on)
