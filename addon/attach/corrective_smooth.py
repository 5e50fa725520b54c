# SPDX-License-Identifier: GPL-3.0-or-later
"""A Corrective Smooth directly behind the Armature modifiers can be replaced by the stage delta_mush: it then
stays in the stack, switched off while Sinew deforms."""

import itertools
from collections.abc import Mapping
from typing import Any

import bpy

from ..base.errors import SinewError
from ..base.phrases import Phrase, phrase
from ..io.actions import animated_paths
from . import layout, properties, property_groups, stack, stage_settings, upstream_proxy

# The modifier's property for each parameter of the stage.
NAMES = {
    "iterations": "iterations",
    "factor": "factor",
    "pin_boundary": "use_pin_boundary",
    "group": "vertex_group",
    "invert_group": "invert_vertex_group",
}


def candidate(obj: bpy.types.Object) -> bpy.types.CorrectiveSmoothModifier | None:
    """Returns the first active Corrective Smooth behind the Armature modifiers, or None."""
    found = (m.name for m in layout.read(obj).behind if m.kind == "CORRECTIVE_SMOOTH" and m.is_on)
    return obj.modifiers.get(next(found, ""))


def why_not(obj: bpy.types.Object, modifier: bpy.types.CorrectiveSmoothModifier) -> str:
    """Returns a sentence where the stage would not give exactly the modifier's shape, else ""."""
    between = _between(obj, modifier)
    path = f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"]'
    beyond = _beyond_bounds(modifier)
    reasons = (
        (modifier.rest_source != "ORCO", "its Rest Source is not Original Coords, but a shape of its own"),
        (bool(between), phrase("{names} between it and the Armature modifier", names=", ".join(between))),
        (modifier.show_viewport != modifier.show_render, "it is on in the viewport or in renders alone"),
        (any(each.startswith(path) for each in animated_paths(obj)), "its settings are animated"),
        (bool(beyond), phrase("{names} beyond what Delta Mush takes", names=", ".join(beyond))),
        (_has_other_vertices(obj), "modifiers in front make other vertices, which it does not smooth"),
        ("delta_mush" in stage_settings.names_on(properties.of(obj)), "Delta Mush is on already"),
    )
    reason = next((reason for holds, reason in reasons if holds), "")
    if not reason:
        return ""
    whole = reason if isinstance(reason, Phrase) else phrase(reason)
    return phrase("{name} stays Blender's: {reason}", name=modifier.name, reason=whole)


def why_none(obj: bpy.types.Object) -> str:
    """Returns a sentence where the mesh has no Corrective Smooth that the stage can replace, else ""."""
    modifier = candidate(obj)
    if modifier is None:
        return phrase("no Corrective Smooth behind its Armature modifier is on")
    return why_not(obj, modifier)


def _between(obj: bpy.types.Object, modifier: bpy.types.CorrectiveSmoothModifier) -> list[str]:
    """Returns the names of the active modifiers between it and the Armature modifiers."""
    before = itertools.takewhile(lambda each: each.name != modifier.name, layout.read(obj).behind)
    return [each.name for each in before if each.is_on]


def _beyond_bounds(modifier: bpy.types.CorrectiveSmoothModifier) -> list[str]:
    values = _values(modifier)
    bounded = [
        each for each in stage_settings.STAGES["delta_mush"].parameters if each.kind in ("int", "float")
    ]
    return [each.label for each in bounded if not each.min <= values[each.id] <= each.max]


def _has_other_vertices(obj: bpy.types.Object) -> bool:
    """Whether upstream modifiers change the number of vertices."""
    if properties.of(obj).storage.upstream_proxy is None:
        return False
    mesh = upstream_proxy.evaluated_mesh(obj, bpy.context.evaluated_depsgraph_get())
    return mesh is not None and len(mesh.vertices) != len(obj.data.vertices)


def take_over(obj: bpy.types.Object) -> None:
    """Has the stage smooth as the modifier did; the modifier is off from the next session.refresh() on.

    Raises SinewError, and changes nothing, where the shape would differ.
    """
    reason = why_none(obj)
    if reason:
        raise SinewError(f"{obj.name}: {reason}")
    modifier, settings = candidate(obj), properties.of(obj)
    replaced = settings.before.smooth
    for name, value in (
        ("name", modifier.name),
        ("uid", modifier.persistent_uid),
        ("show_viewport", modifier.show_viewport),
        ("show_render", modifier.show_render),
    ):
        property_groups.store(replaced, name, value)
    for name, value in _values(modifier).items():
        setattr(settings.delta_mush, name, value)
    settings.delta_mush.enabled = True


def _values(modifier: bpy.types.CorrectiveSmoothModifier) -> dict[str, Any]:
    """Returns the parameters with which the stage smooths as the modifier does."""
    values = {name: getattr(modifier, of_modifier) for name, of_modifier in NAMES.items()}
    return values | {
        "radius": 0.0,
        "weld": False,
        "smooth_type": modifier.smooth_type.lower(),
        "scale": 0.0 if modifier.use_only_smooth else modifier.scale,
    }


def stage_values(obj: bpy.types.Object) -> Mapping[str, Mapping[str, Any]]:
    """Returns how the object's modifiers without Sinew smooth, as skinning.stages.StageValues."""
    modifier = replaced_modifier(obj)
    return {} if modifier is None else {"delta_mush": _values(modifier)}


def replaced_modifier(obj: bpy.types.Object) -> bpy.types.CorrectiveSmoothModifier | None:
    """Returns the modifier that was taken over; None for none."""
    replaced = properties.of(obj).before.smooth
    return stack.modifier_of(obj, replaced, "CORRECTIVE_SMOOTH") if replaced.name else None


def switch(obj: bpy.types.Object, viewport: bool, render: bool) -> None:
    """Gives the modifier that was taken over its own icons in these views, and switches it off in others."""
    modifier, replaced = replaced_modifier(obj), properties.of(obj).before.smooth
    if modifier is None:
        return
    for name, is_own in (("show_viewport", viewport), ("show_render", render)):
        property_groups.assign(modifier, name, is_own and getattr(replaced, name))
