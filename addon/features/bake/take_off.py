# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew off an object that has its shape in a bake from now on."""

from __future__ import annotations

import bpy

from ...attach import attach, corrective_smooth, properties


def take_off(obj: bpy.types.Object) -> None:
    """The Armature modifiers stay, as they were; what is in the bake is not done to it once more."""
    # A parent that deforms would do so on top of the bake.
    properties.of(obj).parent_type = ""
    smooth = corrective_smooth.replaced_modifier(obj)
    attach.take_off(obj)
    if smooth is not None:
        smooth.show_viewport = smooth.show_render = False
