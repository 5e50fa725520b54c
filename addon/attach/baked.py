# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that an object has from a bake, while its Armature modifier is off: shape keys, or a cache that a
modifier plays. Sinew would deform them once more, so Add switches them off, and Remove on again."""

import re

import bpy

from ..base.phrases import phrase
from ..io.actions import curves_of
from . import properties

# What sinew.bake calls its keys, and Blender a copy of one.
_BAKED_KEY = re.compile(r"Frame -?\d[\d.e+-]*")
_CACHES = ("MESH_CACHE", "MESH_SEQUENCE_CACHE")
# A property of the shape keys, as several objects can have them: the names of those that are muted, in lines.
MUTED = "sinew_muted"


def switch_off(obj: bpy.types.Object) -> None:
    keys = obj.data.shape_keys
    animated = [] if keys is None or not keys.is_editable else _animated_keys(keys)
    found = [block for block in animated if _BAKED_KEY.fullmatch(block.name)]
    if found:
        keys[MUTED] = "\n".join(block.name for block in found)
    for block in found:
        block.mute = True
    for modifier in obj.modifiers:
        if modifier.type in _CACHES and (modifier.show_viewport or modifier.show_render):
            kept = properties.of(obj).before.baked.add()
            kept.name, kept.uid = modifier.name, modifier.persistent_uid
            kept.show_viewport, kept.show_render = modifier.show_viewport, modifier.show_render
            modifier.show_viewport = modifier.show_render = False


def switch_on(obj: bpy.types.Object) -> None:
    keys, settings = obj.data.shape_keys, properties.of(obj)
    others = (o for o in bpy.data.objects if o != obj and o.data == obj.data)
    if keys is not None and MUTED in keys and not any(map(properties.has_sinew, others)):
        for name in keys[MUTED].split("\n"):
            if name in keys.key_blocks:
                keys.key_blocks[name].mute = False
        del keys[MUTED]
    for kept in settings.before.baked:
        for modifier in obj.modifiers:
            if modifier.persistent_uid == kept.uid:
                modifier.show_viewport, modifier.show_render = kept.show_viewport, kept.show_render


def notes(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence for what is switched off, and for what may have to be."""
    keys, names = obj.data.shape_keys, [kept.name for kept in properties.of(obj).before.baked]
    found = []
    if keys is not None and MUTED in keys:
        found.append(phrase("Its baked shape keys are muted; Remove unmutes them"))
    if names:
        text = "{names} plays baked shapes, and is off; Remove switches it on again"
        found.append(phrase(text, names=", ".join(names)))
    if keys is not None and _animated_keys(keys):
        found.append(phrase("Its shape keys are animated and deform it, too: mute those that are a bake"))
    return found


def _animated_keys(keys: bpy.types.Key) -> list[bpy.types.ShapeKey]:
    """Returns those that are on and whose values are keyed."""
    paths = {curve.data_path for curve in curves_of(keys)}
    return [block for block in keys.key_blocks if not block.mute and block.path_from_id("value") in paths]
