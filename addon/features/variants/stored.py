# SPDX-License-Identifier: GPL-3.0-or-later
"""The variants of a character: all of its meshes have them, one in each line of a text."""

from collections.abc import Sequence

import bpy

from ...attach import properties
from ...base.errors import WrongUse
from ...skinning.variants import Variant, parse
from ...ui import character, operators


def lines(context: bpy.types.Context) -> list[str]:
    # A mesh that joined the character has none yet.
    texts = (properties.of(obj).variants for obj in character.known_meshes(context))
    return next(filter(None, texts), "").splitlines()


def write(context: bpy.types.Context, texts: Sequence[str]) -> None:
    for obj in operators.sinew_targets(context):
        properties.of(obj).variants = "\n".join(texts)


def read(text: str) -> Variant | None:
    """None for one that this Sinew does not know, as of a newer one."""
    try:
        return parse(text)
    except WrongUse:
        return None


def of_methods(context: bpy.types.Context) -> list[Variant]:
    """Without those that are the Armature modifier."""
    found = map(read, lines(context))
    return [variant for variant in found if variant is not None and variant.method in properties.METHODS]
