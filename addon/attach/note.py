# SPDX-License-Identifier: GPL-3.0-or-later
"""What tells people without Sinew what is missing from a saved file: a text block, and warnings at the
modifiers."""

import bpy

from . import node_group, properties

NAME = "Sinew"
MARK = "sinew_note"
TEXT = """\
This file uses Sinew, an extension for Blender that deforms these meshes:

{names}

With Sinew installed, the meshes deform as soon as the file is opened. Without it, the Armature modifiers
deform them, as closely as Blender can. Leave the modifiers called "Sinew" off then.
"""


def write(objects: list[bpy.types.Object]) -> None:
    """Writes both, before the file is saved; without objects there are none."""
    remove()
    if objects:
        node_group.add_warnings()
        text = bpy.data.texts.new(NAME)
        text[MARK] = True
        lines = (
            f"    {obj.name}, by {properties.method_label(properties.of(obj).method)}" for obj in objects
        )
        text.write(TEXT.format(names="\n".join(lines)))


def remove() -> None:
    """Removes both, which nobody who has Sinew needs."""
    node_group.remove_warnings()
    for text in [text for text in bpy.data.texts if text.get(MARK) and text.library is None]:
        bpy.data.texts.remove(text)
