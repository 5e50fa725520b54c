# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks and reads what Sinew deforms, for baking."""

from __future__ import annotations

import bpy

from ...attach import properties
from ...core.errors import SinewError
from ...deform import session
from ...deform.plan import ARMATURE_MODIFIER_MODES
from ...deform.skinned_object import SkinnedObject


def check_on(obj: bpy.types.Object) -> None:
    """Raises SinewError where Sinew is off."""
    if not properties.of(obj).enabled:
        raise _off(obj)


def state_of(obj: bpy.types.Object) -> SkinnedObject:
    """Returns the object's state at the current frame. Raises SinewError where Sinew does not give its
    modifier a shape."""
    # The depsgraph as it was evaluated for the frame: evaluating what Sinew wrote since is not needed.
    pairs = session.states_of([obj], bpy.context.view_layer.depsgraph)
    if not pairs or obj.mode in ARMATURE_MODIFIER_MODES:
        raise _off(obj)
    return pairs[0][1]


def posed_state_of(obj: bpy.types.Object) -> SkinnedObject:
    """Returns the same where its first Armature modifier takes part; otherwise raises SinewError."""
    state = state_of(obj)
    if state.shown.frames[0] is None:
        raise _off(obj)
    return state


def _off(obj: bpy.types.Object) -> SinewError:
    return SinewError(properties.of(obj).error or f"{obj.name}: switch Sinew on to bake what it shows")
