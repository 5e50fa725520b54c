# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants in an object's settings: what is set there as a variant, and back."""

from collections.abc import Iterable, Mapping

import bpy

from ..skinning import parameters
from ..skinning.parameters import OFF, Value
from ..skinning.variants import BLENDER, SETTINGS, Variant
from . import properties, property_groups, stage_settings


def read(obj: bpy.types.Object) -> Variant:
    """Returns what deforms an object by its settings: with Sinew off, the Armature modifier."""
    if not properties.has_sinew(obj) or not properties.of(obj).enabled:
        return Variant.of(BLENDER)
    settings = properties.of(obj)
    values: dict[str, Value] = {name: getattr(settings, name) for name in SETTINGS}
    for owner, group in properties.SETTING_GROUPS.items():
        own = getattr(settings, owner)
        values |= {f"{owner}.{name}": getattr(own, name) for name in group.__annotations__}
    return Variant.of(settings.method, stage_settings.names_on(settings), values)


def use(objects: Iterable[bpy.types.Object], variant: Variant) -> None:
    """Sets a method with its stages, or the Armature modifier, on objects that have Sinew. The caller has
    them deformed."""
    if variant.method != BLENDER:
        use_values(objects, variant.method, variant.assignments)
        return
    for obj in objects:
        property_groups.assign(properties.of(obj), "enabled", False)


def use_values(objects: Iterable[bpy.types.Object], method: str, values: Mapping[str, Value]) -> None:
    """Sets a method with values by full names, as use(); all others stay as they are."""
    for obj in objects:
        settings = properties.of(obj)
        property_groups.assign(settings, "enabled", True)
        property_groups.assign(settings, "method", method)
        for name, value in values.items():
            assign(obj, name, value)


def with_parameters(obj: bpy.types.Object, method: str, values: Mapping[str, Value]) -> dict[str, Value]:
    """Returns values with the parameters of a method that they leave as an object has them."""
    names = (name for name in parameters.by_full_name() if name.startswith(f"{method}."))
    return {name: stored(obj, name) for name in names} | dict(values)


def assign(obj: bpy.types.Object, name: str, value: Value) -> None:
    """Sets a parameter, or one of SETTINGS, by its full name."""
    owner, own = place(obj, name)
    property_groups.assign(owner, own, stage_settings.OFF if value == OFF else value)


def place(obj: bpy.types.Object, name: str) -> tuple[bpy.types.PropertyGroup, str]:
    """The settings that have a parameter or one of SETTINGS, and its name there."""
    owner, dot, own = name.partition(".")
    settings = properties.of(obj)
    return (getattr(settings, owner), own) if dot else (settings, name)


def stored(obj: bpy.types.Object, name: str) -> Value:
    value: Value = getattr(*place(obj, name))
    return OFF if value == stage_settings.OFF else value
