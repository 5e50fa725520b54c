# SPDX-License-Identifier: GPL-3.0-or-later
"""What Sinew stores of an object, in the .blend file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import sinew

METHODS = {method.name: method for method in sinew.methods()}


@dataclass
class Listeners:
    """Who hears of changed settings; set on registration, as what reacts to settings also reads them."""

    method_changed: Callable[[bpy.types.Object, bpy.types.Context], None] | None = None
    enabled_changed: Callable[[bpy.types.Object, bpy.types.Context], None] | None = None


listeners = Listeners()


def _method_changed(settings: SinewSettings, context: bpy.types.Context) -> None:
    if listeners.method_changed is not None:
        listeners.method_changed(settings.id_data, context)


def _enabled_changed(settings: SinewSettings, context: bpy.types.Context) -> None:
    if listeners.enabled_changed is not None:
        listeners.enabled_changed(settings.id_data, context)


class SinewSettings(bpy.types.PropertyGroup):
    """How Sinew drives this object. `armature_modifier` names the modifier that it stands in for; empty
    where the object is not driven."""

    method: bpy.props.EnumProperty(
        name="Method",
        description="How the bones' motions are blended at each vertex",
        items=[(m.name, m.label, m.description, m.number) for m in METHODS.values()],
        update=_method_changed,
    )
    enabled: bpy.props.BoolProperty(
        name="On",
        description="Deform with Sinew; off: with Blender's Armature modifier, to compare the two",
        default=True,
        options=set(),
        update=_enabled_changed,
    )
    armature: bpy.props.PointerProperty(
        name="Armature",
        description="The armature that deforms this mesh; kept here because the Armature modifier does not "
        "point to it while Sinew is at work",
        type=bpy.types.Object,
        poll=lambda _self, obj: obj.type == "ARMATURE",
    )
    armature_modifier: bpy.props.StringProperty(options={"HIDDEN"})
    attribute: bpy.props.StringProperty(options={"HIDDEN"})
    # The Armature modifier's own flags, given back on removal.
    show_viewport: bpy.props.BoolProperty(options={"HIDDEN"}, default=True)
    show_render: bpy.props.BoolProperty(options={"HIDDEN"}, default=True)
    pose: bpy.props.FloatProperty(
        options={"HIDDEN", "ANIMATABLE"}, description="Carries pose_driver's driver"
    )
    error: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})


def of(obj: bpy.types.Object) -> SinewSettings:
    return obj.sinew


def is_driven(obj: bpy.types.Object) -> bool:
    # Asking for the settings of an object that has none would leave an empty group in the file.
    return obj.type == "MESH" and obj.is_property_set("sinew") and bool(obj.sinew.armature_modifier)


def clear(obj: bpy.types.Object) -> None:
    """Takes Sinew's settings out of the object, as if they had never been."""
    obj.property_unset("sinew")
