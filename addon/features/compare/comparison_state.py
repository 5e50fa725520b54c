# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's settings of a comparison, and the positions of its copies."""

from __future__ import annotations

import bpy

from ...attach import properties
from ...deform import characters
from ...skinning.variants import is_key, parse
from ...ui.translations import tr
from . import offset_nodes

# Numbers of variants in lists of choices.
FIRST_VARIANT = 10_000
_items: dict[tuple[str, int], tuple] = {}

SIDE_BY_SIDE, OVERLAID, ONE_OF_TWO = "SIDE", "OVERLAY", "FLIP"


def _changed(state: SinewComparison, _context: bpy.types.Context) -> None:
    arrange(state)


def _compared_methods(state: SinewComparison, _context: bpy.types.Context) -> list[tuple]:
    choices: dict[str, tuple] = {item[0]: item for item in properties.method_choices()}
    keys = methods_of(state)
    variants = [key for key in keys if is_key(key)]
    # Blender does not keep the texts of computed items.
    for number, key in enumerate(variants, start=FIRST_VARIANT):
        _items[key, number] = (key, *(2 * (label_of(key),)), "NONE", number)
        choices[key] = _items[key, number]
    return [choices[key] for key in keys]


class SinewComparison(bpy.types.PropertyGroup):
    """Set while the scene shows a comparison."""

    collection: bpy.props.PointerProperty(type=bpy.types.Collection, options={"HIDDEN"})
    axis: bpy.props.FloatVectorProperty(
        description="The direction of the row in the world",
        size=3,
        default=(1.0, 0.0, 0.0),
        options={"HIDDEN"},
    )
    spacing: bpy.props.FloatProperty(
        name="Spacing",
        description="From one character to the next",
        subtype="DISTANCE",
        default=1.0,
        options=set(),
        update=_changed,
    )
    arrangement: bpy.props.EnumProperty(
        name="Arrangement",
        description="Where the copies are shown",
        items=[
            (SIDE_BY_SIDE, "Side by Side", "Each copy at a place of its own"),
            (OVERLAID, "Overlay", "All copies at the first place beside the original"),
            (ONE_OF_TWO, "Flip", "One of two copies at a time, at the first place beside the original"),
        ],
        options=set(),
        update=_changed,
    )
    first: bpy.props.EnumProperty(
        name="First Method",
        description="The method that is shown before a flip",
        items=_compared_methods,
        options=set(),
        update=_changed,
    )
    second: bpy.props.EnumProperty(
        name="Second Method",
        description="The method that is shown after a flip",
        items=_compared_methods,
        options=set(),
        update=_changed,
    )
    shows_second: bpy.props.BoolProperty(options={"HIDDEN"}, update=_changed)
    # Of the 3D view: its location and distance before it was moved to show all, and then.
    view_before: bpy.props.FloatVectorProperty(size=4, options={"HIDDEN"})
    view_moved: bpy.props.FloatVectorProperty(size=4, options={"HIDDEN"})


def of_scene(scene: bpy.types.Scene) -> SinewComparison | None:
    """None where the scene shows no comparison."""
    # Reading an unset property would leave an empty group in the file.
    return scene.sinew_comparison if scene.is_property_set("sinew_comparison") else None


def copies_of(state: SinewComparison) -> list[bpy.types.Object]:
    """Returns the copies that are still in the comparison's collection."""
    if state.collection is None:
        return []
    return [obj for obj in state.collection.all_objects if properties.is_copy(obj)]


def methods_of(state: SinewComparison) -> list[str]:
    """Returns the methods that have copies, in the table's order; then keys of variants, in theirs."""
    there = dict.fromkeys(properties.of(obj).identity.method for obj in copies_of(state))
    return [name for name in characters.method_names() if name in there] + list(filter(is_key, there))


def label_of(name: str) -> str:
    """name: of a method, or the key of a variant"""
    return tr(parse(name).title) if is_key(name) else tr(properties.method_label(name))


def arrange(state: SinewComparison) -> None:
    """Moves all copies to the positions of the arrangement."""
    methods = methods_of(state)
    shown = shown_methods(state)
    for copy in copies_of(state):
        method = properties.of(copy).identity.method
        place = 1 + methods.index(method) if state.arrangement == SIDE_BY_SIDE else 1
        offset_nodes.set_offset(copy, tuple(place * state.spacing * x for x in state.axis))
        # Hidden per view layer, as the copies' own flag would make Blender rebuild its depsgraph.
        for layer in state.id_data.view_layers:
            if copy.name in layer.objects:
                copy.hide_set(method not in shown, view_layer=layer)


def shown_methods(state: SinewComparison) -> list[str]:
    """The methods whose copies are shown now."""
    if state.arrangement != ONE_OF_TWO:
        return methods_of(state)
    return [state.second if state.shows_second else state.first]
