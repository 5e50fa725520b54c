# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of stages, one property group for each, made from the library's list."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import sinew

from ..core import parameters
from .method_items import method_items

STAGES = {stage.name: stage for stage in sinew.stages()}
# The choice beside the methods where a parameter names one: the stage does nothing.
OFF = "OFF"
# Of a library override, only what is marked so is kept with the file.
_OVERRIDE = {"LIBRARY_OVERRIDABLE"}


def as_stored(value: parameters.Value) -> parameters.Value:
    """The value of a property for one that a command or a job file has."""
    return OFF if value == parameters.OFF else value


def groups(update: Callable[[bpy.types.PropertyGroup, bpy.types.Context], None]) -> dict[str, type]:
    """A class of property groups for each stage, by its name. `update` is called at each change."""
    return {
        name: type(
            f"SinewStage{name.title().replace('_', '')}",
            (bpy.types.PropertyGroup,),
            {
                "__doc__": stage.description,
                "__annotations__": {each.id: _property(each, update) for each in stage.parameters},
            },
        )
        for name, stage in STAGES.items()
    }


def _property(parameter: sinew.Parameter, update: Callable) -> object:
    facts = {
        "name": parameter.label,
        "description": parameter.description,
        "update": update,
        "override": _OVERRIDE,
    }
    if parameter.kind == "method":
        choices = [(OFF, "Off", "Without this stage", 0), *method_items(1)]
        return bpy.props.EnumProperty(items=choices, default=OFF, **facts)
    if parameter.kind == "enum":
        items = [(choice, choice.replace("_", " ").title(), "") for choice in parameter.choices]
        return bpy.props.EnumProperty(items=items, default=parameter.default, **facts)
    if parameter.kind == "vertex_group":
        return bpy.props.StringProperty(**facts)
    if parameter.kind == "bool":
        return bpy.props.BoolProperty(default=parameter.default, **facts)
    number = bpy.props.IntProperty if parameter.kind == "int" else bpy.props.FloatProperty
    # Blender takes no infinite bound.
    bounds = {"min": parameter.min, "max": parameter.max}
    finite = {name: value for name, value in bounds.items() if abs(value) < float("inf")}
    if parameter.kind == "int":
        finite = {name: int(value) for name, value in finite.items()}
    return number(default=parameter.default, **finite, **facts)
