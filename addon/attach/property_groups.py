# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies, sets and clears properties and groups of them."""

import functools
from collections.abc import Iterable

import bpy


def copy(source: bpy.types.PropertyGroup, target: bpy.types.PropertyGroup) -> None:
    """Copies all values of a group of settings to another, without calling the listeners."""
    for name, prop in source.bl_rna.properties.items():
        if name == "rna_type":
            continue
        if prop.type == "COLLECTION":
            getattr(target, name).clear()
            for item in getattr(source, name):
                copy(item, getattr(target, name).add())
        elif prop.type == "POINTER" and isinstance(getattr(source, name), bpy.types.PropertyGroup):
            if source.is_property_set(name):
                copy(getattr(source, name), getattr(target, name))
        elif not prop.is_readonly and source.is_property_set(name):
            value = getattr(source, name)
            # By key: assigning to the property itself calls the listeners.
            if prop.type == "ENUM":
                target[name] = next(i.value for i in prop.enum_items if i.identifier == value)
            elif prop.type == "BOOLEAN":
                target[name] = value
            else:
                setattr(target, name, value)


def copy_groups(
    source: bpy.types.PropertyGroup, target: bpy.types.PropertyGroup, names: Iterable[str]
) -> None:
    """Copies some groups within a group. Groups that do not exist are not read, as that would make them."""
    for name in names:
        if source.is_property_set(name):
            copy(getattr(source, name), getattr(target, name))


def assign(struct: bpy.types.bpy_struct, name: str, value: object) -> None:
    """Assigns only a different value: each assignment makes Blender evaluate the object."""
    if getattr(struct, name) != value:
        setattr(struct, name, value)


def store(group: bpy.types.PropertyGroup, name: str, value: bool | int | float | str) -> None:
    """Sets a value that only Sinew uses, without Blender's update: that would touch the object's mesh, as a
    change of weights does."""
    if getattr(group, name) != value:
        group[name] = value


def clear_pointers(group: bpy.types.PropertyGroup, target: bpy.types.ID) -> bool:
    """Clears the pointers to the target, also of groups within the group. Returns whether there were any."""
    found = False
    for name, kind in _references(type(group)):
        value = getattr(group, name)
        if value == target:
            setattr(group, name, None)
            found = True
        for each in value if kind == "COLLECTION" else (value,):
            if isinstance(each, bpy.types.PropertyGroup):
                found |= clear_pointers(each, target)
    return found


@functools.cache
def _references(group: type[bpy.types.PropertyGroup]) -> list[tuple[str, str]]:
    """Returns the names and types of its properties that refer to something. Cached, as each undo asks."""
    properties = group.bl_rna.properties.items()
    kinds = ((name, prop.type) for name, prop in properties if name != "rna_type")
    return [(name, kind) for name, kind in kinds if kind in ("POINTER", "COLLECTION")]
