# SPDX-License-Identifier: GPL-3.0-or-later
"""Small meshes, left to their Armature modifiers where these give the same shape as Sinew: for few vertices
they take less time than the request for points alone.

Sinew stays on and can measure, bake and compare as usual; only who deforms each frame differs.
"""

import bpy

from ..attach import attach, layout, pose_driver, properties, stage_settings, upstream_proxy
from ..attach.layout import Layout, method_of
from ..attach.normals import Kind
from ..io.actions import animated_paths
from ..skinning.scale_rule import BLENDER_4

# With fewer vertices an Armature modifier is faster (bench/README.md), by method.
VERTICES = {"lbs": 10_000, "dq": 6_000}
# The same where Sinew gives the normals that draw the mesh, by normals.Kind: these take Blender more time.
VERTICES_WITH_NORMALS = {
    Kind.VERTEX: {"lbs": 5_000, "dq": 4_000},
    Kind.CORNER: {"lbs": 3_000, "dq": 2_500},
    Kind.CUSTOM: {"lbs": 1_500, "dq": 1_500},
}
# Commands set this to False: they compare Sinew with the modifier, and save files in which Sinew deforms.
is_used = True


def is_builtin_faster(obj: bpy.types.Object, now: Layout, given: Kind | None) -> bool:
    """Whether the Armature modifiers of a skinned object, as they are set, give its shape in less time.

    given  the normals that Sinew would give along with it; None where Blender computes them
    """
    settings = properties.of(obj)
    limits = VERTICES if given is None else VERTICES_WITH_NORMALS[given]
    return (
        is_used
        and settings.leave_small
        and len(obj.data.vertices) < limits.get(settings.method, 0)
        # The heat map's colours need the points.
        and not settings.heat
        and has_builtin_shape(obj)
        and not other_volume(obj)
        and not upstream_proxy.is_needed(obj, now)
        and not any(p.startswith("sinew.") and p != pose_driver.PATH for p in animated_paths(obj))
    )


def has_builtin_shape(obj: bpy.types.Object) -> bool:
    """Whether Armature modifiers, with a suitable Preserve Volume, give the shape that Sinew is set to."""
    settings = properties.of(obj)
    return (
        VERTICES.keys() >= set(settings.methods)
        and settings.scale_rule == BLENDER_4.name
        and stage_settings.has_defaults(settings, VERTICES)
        and not stage_settings.names_on(settings)
    )


def other_volume(obj: bpy.types.Object) -> list[bpy.types.ArmatureModifier]:
    """Returns the Armature modifiers whose Preserve Volume differs from Sinew's method and is not
    followed."""
    now = layout.read(obj)
    pairs = attach.replaced_modifiers(obj, now)
    methods = attach.methods_by_name(properties.of(obj))
    return [
        modifier
        for skin, (modifier, replaced) in zip(now.skins, pairs, strict=True)
        if method_of(modifier) != methods[replaced.name] and not attach.is_volume_followed(obj, skin)
    ]


def fingerprint(obj: bpy.types.Object) -> list[str]:
    """Those of the settings behind is_builtin_faster() that scripts and animation can change between two
    frames without an event."""
    settings = properties.of(obj)
    modifiers = [obj.modifiers.get(replaced.name) for replaced in settings.replaced_modifiers]
    methods = [method_of(modifier) if modifier is not None else "" for modifier in modifiers]
    own = [settings.method, settings.scale_rule, str(stage_settings.has_defaults(settings, VERTICES))]
    return [*own, *stage_settings.names_on(settings), *methods]
