# SPDX-License-Identifier: GPL-3.0-or-later
"""What acts otherwise with Sinew than without (docs/parity.md): exporters, tools of others, and modifiers
behind it, as behind Geometry Nodes (seen on 4.2 to 5.2)."""

from collections.abc import Iterator

import bpy

from ..base.phrases import phrase
from . import layout, properties, upstream_proxy
from .modifier_types import ONLY_DEFORM

# Such a tool also applies Sinew's modifier, and Sinew then removes the Armature modifiers.
APPLYING = phrase(
    "Switch Sinew off before a tool applies all modifiers but the Armature modifier: it would apply Sinew's"
)


def notes(obj: bpy.types.Object) -> list[str]:
    """Returns a sentence for each thing that goes wrong while Sinew deforms the mesh."""
    if not properties.of(obj).replaces_modifiers:
        return []
    found, now = [], layout.read(obj)
    if upstream_proxy.shares_mesh(obj) and obj.data.users - obj.data.use_fake_user == 2:
        text = "Switch Sinew off before a script applies its modifiers: Sinew also uses its mesh meanwhile"
        found.append(phrase(text))
    # FBX files have no shape keys where any modifier but the Armature modifier is on.
    others = [m for m in now.modifiers if m.kind != "ARMATURE" and m.name not in now.own and m.is_on]
    if obj.data.shape_keys is not None and not others:
        found.append(phrase("Switch Sinew off before an export to FBX, or the file has no shape keys"))
    return found


def warnings(obj: bpy.types.Object, now: layout.Layout | None = None) -> list[str]:
    """Returns a sentence for each downstream modifier that acts otherwise with Sinew than without.

    now  its layout; None to read it
    """
    changed = _changed(obj, now or layout.read(obj))
    return [phrase(text, name=modifier.name) for modifier in changed if (text := _warning(modifier))]


def _changed(obj: bpy.types.Object, now: layout.Layout) -> Iterator[bpy.types.Modifier]:
    """Yields the downstream modifiers in front of which Sinew's is the first that does more than deform."""
    if any(each.is_on and each.kind not in ONLY_DEFORM for each in now.ahead):
        return
    for each in now.behind:
        if each.is_on:
            if each.kind not in ONLY_DEFORM:
                return
            yield obj.modifiers[each.name]


def _warning(modifier: bpy.types.Modifier) -> str:
    # Blender uses the first vertices, as many as are in the list.
    if modifier.type == "HOOK" and len(modifier.vertex_indices) and not modifier.vertex_group:
        return (
            "{name}: behind Sinew's modifier, Blender moves other vertices than those assigned to this Hook; "
            "give it a vertex group"
        )
    if modifier.type == "PARTICLE_SYSTEM" and modifier.particle_system.settings.emit_from != "VERT":
        return (
            "{name}: behind Sinew's modifier, Blender puts these particles and hairs elsewhere on the mesh; "
            "emit them from vertices, from another mesh, or leave this mesh to its Armature modifier"
        )
    if modifier.type == "CLOTH" and modifier.settings.rest_shape_key is not None:
        return (
            "{name}: behind Sinew's modifier, Blender does not use the Rest Shape Key of this Cloth as it "
            "should; leave this mesh to its Armature modifier"
        )
    return ""
