# SPDX-License-Identifier: GPL-3.0-or-later
"""The two routes by which Sinew deforms: within Blender's evaluation, and after the update."""

from __future__ import annotations

import bpy
from sinew_addon.attach import properties, stack
from sinew_addon.deform import safe_mode, session, small_meshes

EVALUATION, UPDATE = "evaluation", "update"
ROUTES = (EVALUATION, UPDATE)


def force(route: str) -> None:
    """From now on Sinew uses this route; EVALUATION only where possible, as it is not for some rigs."""
    safe_mode.set_forced(route == UPDATE)
    # Small meshes would use the Armature modifier, which would be compared with itself.
    small_meshes.is_used = False


def release() -> None:
    """Undoes force()."""
    safe_mode.set_forced(None)
    small_meshes.is_used = True


class NotBySinewError(AssertionError):
    """The shape was not made by Sinew."""


def taken(obj: bpy.types.Object, shapes_before: int) -> str:
    """The route by which Sinew made the shape that is shown.

    shapes_before  how many shapes it had made when the pose last changed

    Raises NotBySinewError if the shape is not Sinew's.
    """
    settings, state = properties.of(obj), session.skinned_of(obj)
    if not settings.enabled:
        raise NotBySinewError(f"Sinew is off: {settings.error}")
    if state is None or state.shown.frames is None:
        raise NotBySinewError("Sinew has not deformed it")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    modifiers, is_within = obj.evaluated_get(depsgraph).modifiers, bool(state.evaluation.given)
    if not modifiers[stack.sinew_modifier(obj).name].show_viewport:
        raise NotBySinewError("its modifier is off")
    for modifier in modifiers:
        replaced = modifier.type == "ARMATURE" and modifier.name in settings.replaced_modifiers
        if is_within and replaced and modifier.show_viewport:
            raise NotBySinewError(f"the Armature modifier {modifier.name} is on")
    if state.shown.number <= shapes_before:
        raise NotBySinewError("Sinew made no shape for this pose")
    return EVALUATION if is_within else UPDATE
