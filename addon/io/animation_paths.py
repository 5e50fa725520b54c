# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds which properties of an object its animation sets. Changes nothing."""

import bpy

from . import actions


def animated_paths(obj: bpy.types.Object) -> set[str]:
    """Returns the data paths that the object's actions and drivers set."""
    return {curve.data_path for curve in curves_of(obj)}


def curves_of(owner: bpy.types.Object | bpy.types.Mesh | bpy.types.Key) -> list[bpy.types.FCurve]:
    """Returns the curves of its actions, also in strips, and of its drivers."""
    animation = owner.animation_data
    if animation is None:
        return []
    played = [actions.all_curves(p.action, actions.slot_of(p)) for p in players(animation)]
    return [*animation.drivers, *(curve for each in played for curve in each)]


def players(animation: bpy.types.AnimData) -> list[bpy.types.AnimData | bpy.types.NlaStrip]:
    """Returns everything that plays an action, or could."""
    return [animation, *(strip for track in animation.nla_tracks for strip in track.strips)]


def is_animated(obj: bpy.types.Object, modifier: bpy.types.Modifier, name: str) -> bool:
    """Whether keys or drivers set a modifier's property."""
    return f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].{name}' in animated_paths(obj)


def is_visibility_animated(obj: bpy.types.Object, modifier: bpy.types.Modifier) -> bool:
    """Whether keys or drivers switch a modifier on and off."""
    start = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].show_'
    return not animated_paths(obj).isdisjoint((f"{start}viewport", f"{start}render"))
