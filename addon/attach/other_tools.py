# SPDX-License-Identifier: GPL-3.0-or-later
"""Exporters and tools of others that do with Sinew what they do not do without it (docs/parity.md)."""

from __future__ import annotations

import bpy

from ..core.icons import Situation
from ..core.phrases import phrase
from . import properties, stack, upstream_proxy

# Such a tool also applies Sinew's modifier, and Sinew then removes the Armature modifiers.
APPLYING = phrase(
    "Switch Sinew off before a tool applies all modifiers but the Armature modifier: it would apply Sinew's"
)


def notes(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence for each thing that goes wrong while Sinew deforms the mesh."""
    if not properties.of(obj).replaces_modifiers:
        return []
    found, own = [], stack.own_modifiers(obj)
    if Situation(properties.of(obj).stack.situation) is Situation.ALONE:
        found.append(
            phrase("Switch Sinew off before other tools look for its Armature modifier: that is off")
        )
    if upstream_proxy.shares_mesh(obj) and obj.data.users - obj.data.use_fake_user == 2:
        text = "Switch Sinew off before a script applies its modifiers: Sinew also uses its mesh meanwhile"
        found.append(phrase(text))
    # FBX files have no shape keys where any modifier but the Armature modifier is on.
    others = [m for m in obj.modifiers if m.type != "ARMATURE" and m not in own and stack.is_on(m)]
    if obj.data.shape_keys is not None and not others:
        found.append(phrase("Switch Sinew off before an export to FBX, or the file has no shape keys"))
    return found
