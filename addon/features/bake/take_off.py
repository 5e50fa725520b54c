# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes Sinew off an object whose shape is in a bake from now on."""

from __future__ import annotations

import bpy

from ...attach import attach, corrective_smooth, properties


def take_off(obj: bpy.types.Object) -> None:
    """Takes Sinew off; the Armature modifiers stay as they were, and anything that the bake already includes
    is switched off."""
    # A deforming parent would deform the baked shape again.
    properties.of(obj).parent_type = ""
    smooth = corrective_smooth.replaced_modifier(obj)
    attach.take_off(obj)
    if smooth is not None:
        smooth.show_viewport = smooth.show_render = False
