# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of stages and methods, one property group for each, made from the library's lists."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import groupby
from typing import Any

import bpy
import sinew

from ..io import spaces
from ..skinning import engines, parameters
from . import property_groups

STAGES = {stage.name: stage for stage in sinew.stages()}
# The parameter that switches each stage on: its first.
_SWITCHES = {stage.name: stage.parameters[0].id for stage in STAGES.values()}
# Methods that have parameters.
METHODS = {name: method for name, method in engines.METHODS.items() if method.parameters}
# Full names of parameters that are lengths.
LENGTHS = {
    f"{name}.{each.id}"
    for name, owner in (STAGES | METHODS).items()
    for each in owner.parameters
    if each.unit == "length"
}
# What the library's list leaves open: of a choice, its label and its tooltip.
_CHOICES = {
    "0": ("Nearest Rotation", "Variant 0 of the paper: the rotation that fits the neighbourhood best"),
    "2": ("Blended Quaternion", "Variant 2 of the paper: the blended quaternion, faster"),
    "4": ("Smoothed Weights", "Variant 4 of the paper: the blended quaternion of smoothed weights, fastest"),
    "blender": ("Shortest", "As Blender: a vertex rotates the shortest way between its bones"),
    "hierarchy": ("Along the Chain", "Rotations add up from bone to bone, beyond 180 degrees"),
}
_LARGE_GROUP = 4
# Scales that differ by no more than this part are the same: matrices of objects that rotate are rounded.
SAME_SCALE = 1e-4
# Choice of a parameter that names a method: the stage is off.
OFF = "OFF"
# On a library override, Blender saves only properties with this flag.
OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}


def groups(
    kind: str,
    owners: Mapping[str, sinew.Method | engines.Engine | sinew.Stage],
    update: Callable[[bpy.types.PropertyGroup, bpy.types.Context], None],
) -> dict[str, type]:
    """Returns a property group class for each of STAGES or METHODS, by its name. `update` is called at each
    change."""
    return {
        name: type(
            f"Sinew{kind}{name.title().replace('_', '')}",
            (bpy.types.PropertyGroup,),
            {
                "__doc__": owner.description,
                "__annotations__": {each.id: _property(each, update) for each in owner.parameters},
            },
        )
        for name, owner in owners.items()
    }


def method_values(settings: bpy.types.PropertyGroup, methods: Iterable[str]) -> dict[str, parameters.Value]:
    """Returns the parameters of some methods by their full names, as Deformer.deform() takes them: lengths in
    units of the mesh.

    settings  an object's
    """
    return {
        f"{name}.{each.id}": _value(settings, name, each)
        for name in methods
        if name in METHODS
        for each in METHODS[name].parameters
    }


def has_defaults(settings: bpy.types.PropertyGroup, methods: Iterable[str]) -> bool:
    """Whether all parameters of these methods have their defaults."""
    return all(
        getattr(getattr(settings, name), each.id) == each.default
        for name in methods
        if name in METHODS
        for each in METHODS[name].parameters
    )


def is_on(settings: bpy.types.PropertyGroup, name: str) -> bool:
    """Whether a stage is on, by its first parameter."""
    return getattr(getattr(settings, name), _SWITCHES[name]) not in (False, OFF)


def names_on(settings: bpy.types.PropertyGroup, among: Iterable[str] = STAGES) -> list[str]:
    """Returns the stages that are on in an object's settings."""
    return [name for name in among if is_on(settings, name)]


def values_of(settings: bpy.types.PropertyGroup, name: str) -> dict[str, Any]:
    """Returns the parameters of a stage by their ids, without vertex groups; lengths in units of the mesh."""
    own = (each for each in STAGES[name].parameters if each.kind != "vertex_group")
    return {each.id: _value(settings, name, each) for each in own}


def _value(settings: bpy.types.PropertyGroup, name: str, parameter: sinew.Parameter) -> Any:
    value = getattr(getattr(settings, name), parameter.id)
    return value / (settings.storage.world_scale or 1.0) if parameter.unit == "length" else value


def note_scale(obj: bpy.types.Object) -> None:
    """Notes how large the object is in the world, for lengths."""
    property_groups.store(obj.sinew.storage, "world_scale", spaces.scale_of(obj))


def has_other_scale(obj: bpy.types.Object) -> bool:
    """Whether it is not as it was noted."""
    noted, scale = obj.sinew.storage.world_scale, spaces.scale_of(obj)
    return noted > 0.0 and abs(noted - scale) > SAME_SCALE * scale


def vertex_groups(settings: bpy.types.PropertyGroup) -> dict[str, str]:
    """Returns the name of the vertex group of each stage that takes one, by the stage's name; empty where
    none is chosen."""
    return {
        name: getattr(getattr(settings, name), each.id)
        for name, stage in STAGES.items()
        for each in stage.parameters
        if each.kind == "vertex_group"
    }


def _property(parameter: sinew.Parameter, update: Callable) -> object:
    facts = {
        "name": parameter.label,
        "description": parameter.description,
        "update": update,
        "override": OVERRIDABLE,
    }
    if parameter.kind == "method":
        choices = [(OFF, "Off", "Without this stage", 0), *method_items(1)]
        return bpy.props.EnumProperty(items=choices, default=OFF, **facts)
    if parameter.kind == "enum":
        items = [
            (name, *_CHOICES.get(name, (name.replace("_", " ").title(), parameter.description)))
            for name in parameter.choices
        ]
        return bpy.props.EnumProperty(items=items, default=parameter.default, **facts)
    if parameter.kind == "vertex_group":
        return bpy.props.StringProperty(**facts)
    if parameter.kind == "bool":
        return bpy.props.BoolProperty(default=parameter.default, **facts)
    number = bpy.props.IntProperty if parameter.kind == "int" else bpy.props.FloatProperty
    if parameter.unit == "length":
        facts["subtype"] = "DISTANCE"
    elif parameter.unit == "factor" and (parameter.min, parameter.max) == (0.0, 1.0):
        facts["subtype"] = "FACTOR"
    # Blender takes no infinite bound.
    bounds = {"min": parameter.min, "max": parameter.max}
    finite = {name: value for name, value in bounds.items() if abs(value) < float("inf")}
    if parameter.kind == "int":
        finite = {name: int(value) for name, value in finite.items()}
    return number(default=parameter.default, **finite, **facts)


def method_items(first_number: int = 0) -> list[tuple[str, str, str, int]]:
    """Returns the items. Blender shows an item without identifier as the heading of a new column, so only
    large groups have one. A property with these items needs a default: it could be a heading otherwise.

    first_number  added to the numbers of methods, which start at 1
    """
    items = []
    groups = groupby(engines.METHODS.values(), lambda method: method.group)
    for number, (group, each) in enumerate(groups, start=1):
        methods = list(each)
        if len(methods) >= _LARGE_GROUP:
            # Negative, so never the value of a property.
            items.append(("", group, "", -number))
        items += [(m.name, m.label, m.description, m.number + first_number) for m in methods]
    return items
