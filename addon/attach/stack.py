# SPDX-License-Identifier: GPL-3.0-or-later
"""The modifiers themselves that a layout names, and their order in the stack."""

import itertools
from collections.abc import Callable, Collection

import bpy

from . import layout, modifier_types, properties
from .layout import Layout


def sinew_modifier(obj: bpy.types.Object) -> bpy.types.NodesModifier | None:
    """Returns Sinew's own modifier."""
    return obj.modifiers.get(layout.read(obj).sinew)


def helping_modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Returns those of Sinew's modifiers that change nothing (undeformed.py)."""
    return [obj.modifiers[name] for name in layout.read(obj).helping]


def armature_modifier(obj: bpy.types.Object) -> bpy.types.ArmatureModifier | None:
    """Returns the first Armature modifier that Sinew replaces, or would replace."""
    return next(iter(armature_modifiers(obj)), None)


def armature_modifiers(obj: bpy.types.Object) -> list[bpy.types.ArmatureModifier]:
    """Returns the Armature modifiers that Sinew replaces, or would replace."""
    return [obj.modifiers[name] for name in layout.read(obj).replaced]


def modifier_of(
    obj: bpy.types.Object,
    kept: properties.SinewReplacedModifier | properties.SinewSwitchedOff,
    kind: str = "ARMATURE",
) -> bpy.types.Modifier | None:
    """Returns the modifier of this type that Sinew has replaced or switched off, even if it was moved and
    renamed; else one of its name."""
    number = layout.find(layout.read(obj).modifiers, kind, kept)
    return None if number is None else obj.modifiers[number]


def position_own(obj: bpy.types.Object, now: Layout) -> Layout:
    """Moves Sinew's modifiers behind the Armature modifiers that it replaces: it sets each vertex to its
    point regardless of the modifiers before it. In front of them or between them, even one that is off would
    decide what a Multi Modifier mixes with. Returns the layout now."""
    if any(modifier.kind in modifier_types.NEED_ORIGINAL_MESH for modifier in now.behind):
        return now
    pairs = itertools.pairwise([now.replaced[-1], *now.own] if now.replaced else [])
    are_moved = [move_behind(obj, name, ahead) for ahead, name in pairs]
    return layout.read(obj) if any(are_moved) else now


def move_behind(obj: bpy.types.Object, name: str, other: str) -> bool:
    """Moves a modifier directly behind another one. Returns whether it was not there."""
    own, ahead = obj.modifiers.find(name), obj.modifiers.find(other)
    if own != ahead + 1:
        obj.modifiers.move(own, ahead if own < ahead else ahead + 1)
    return own != ahead + 1


def has_armature_modifier(obj: bpy.types.Object) -> bool:
    """Whether there is one at all; for many objects, this is far quicker than their layouts."""
    return any(modifier.type == "ARMATURE" for modifier in obj.modifiers)


def of_nodes(
    obj: bpy.types.Object, is_wanted: Callable[[bpy.types.NodeTree | None], bool]
) -> bpy.types.NodesModifier | None:
    """Returns the first Geometry Nodes modifier with such a node group."""
    return next((m for m in obj.modifiers if m.type == "NODES" and is_wanted(m.node_group)), None)


def remove_types(obj: bpy.types.Object, types: Collection[str]) -> None:
    for modifier in [modifier for modifier in obj.modifiers if modifier.type in types]:
        obj.modifiers.remove(modifier)


def add_last_but(obj: bpy.types.Object, but: str, name: str, kind: str) -> bpy.types.Modifier:
    """Returns a new modifier at the end of the stack, in front of modifiers of the type `but` there."""
    behind = list(itertools.takewhile(lambda each: each.type == but, reversed(obj.modifiers)))
    modifier = obj.modifiers.new(name, kind)
    # Pinned modifiers are behind all others.
    modifier.use_pin_to_last = all(each.use_pin_to_last for each in behind)
    obj.modifiers.move(obj.modifiers.find(modifier.name), len(obj.modifiers) - 1 - len(behind))
    return modifier
