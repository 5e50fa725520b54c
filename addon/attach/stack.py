# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds Sinew's modifier, the Armature modifiers, and those before and behind them in an object's stack."""

import itertools
from collections.abc import Iterator

import bpy

from ..io.actions import is_visibility_animated
from . import node_group, properties

# These change no positions, topology or weights, so they may be before the Armature modifier.
HARMLESS_UPSTREAM = {"NORMAL_EDIT", "UV_PROJECT", "UV_WARP", "WEIGHTED_NORMAL"}

# In the paint modes Blender leaves out modifiers that do not say which vertex of the mesh each of their
# vertices comes from (measured on 4.2 and 5.2).
LEFT_OUT_IN_PAINT = {
    "BEVEL",
    "BOOLEAN",
    "BUILD",
    "DECIMATE",
    "OCEAN",
    "REMESH",
    "SCREW",
    "SKIN",
    "VOLUME_TO_MESH",
    "WIREFRAME",
}


# Blender permits no modifier that does more than deform in front of these, and puts a new one in front of it.
NEED_ORIGINAL_MESH = {"MULTIRES", "SOFT_BODY"}
# Behind these alone, Blender knows that the mesh is only deformed.
ONLY_DEFORM = {
    "ARMATURE",
    "CAST",
    "CLOTH",
    "COLLISION",
    "CORRECTIVE_SMOOTH",
    "CURVE",
    "DISPLACE",
    "HOOK",
    "LAPLACIANDEFORM",
    "LAPLACIANSMOOTH",
    "LATTICE",
    "MESH_CACHE",
    "MESH_DEFORM",
    "PARTICLE_SYSTEM",
    "SHRINKWRAP",
    "SIMPLE_DEFORM",
    "SMOOTH",
    "SURFACE",
    "SURFACE_DEFORM",
    "WARP",
    "WAVE",
}
MARK_NAME = "Sinew Stack Mark"


def is_on(modifier: bpy.types.Modifier) -> bool:
    return modifier.show_viewport or modifier.show_render


def can_be_on(obj: bpy.types.Object, modifier: bpy.types.Modifier) -> bool:
    """Whether it is on, or an animation may switch it on."""
    return is_on(modifier) or is_visibility_animated(obj, modifier)


def sinew_modifier(obj: bpy.types.Object) -> bpy.types.NodesModifier | None:
    """Returns Sinew's own modifier. One that has no node group is recognised by its uid, or, without Sinew's
    settings, by its name."""
    mark = mark_modifier(obj)
    nodes = [m for m in obj.modifiers if m.type == "NODES" and m != mark]
    bare = (m for m in nodes if m.node_group is None and _is_ours(obj, m))
    return next((m for m in nodes if node_group.is_sinew(m)), None) or next(bare, None)


def neutral_modifier(obj: bpy.types.Object) -> bpy.types.LaplacianDeformModifier | None:
    """Returns Sinew's modifier that changes nothing (undeformed.py), be it renamed; else one of its name."""
    found = [m for m in obj.modifiers if m.type == "LAPLACIANDEFORM" and not m.is_bind]
    same = (m for m in found if m.persistent_uid == properties.of(obj).stack.neutral_uid)
    return next(same, None) or next((m for m in found if m.name.startswith("Sinew")), None)


def mark_modifier(obj: bpy.types.Object) -> bpy.types.NodesModifier | None:
    """Returns Sinew's modifier that marks the mesh (undeformed.py), also without its node group."""
    bare = [m for m in obj.modifiers if m.type == "NODES" and m.node_group is None]
    same = (m for m in bare if m.persistent_uid == properties.of(obj).stack.mark_uid)
    named = (m for m in bare if m.name.startswith(MARK_NAME))
    return next(itertools.chain(marks_with_group(obj), same, named), None)


def marks_with_group(obj: bpy.types.Object) -> Iterator[bpy.types.NodesModifier]:
    """Yields those that mark the mesh, with their node group. Reads no settings, which would make them."""
    for modifier in obj.modifiers:
        group = modifier.node_group if modifier.type == "NODES" else None
        if group is not None and group.get(node_group.MARK) == node_group.STACK_MARK:
            yield modifier


def own_modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Returns the modifiers that Sinew put on the object, in their order."""
    own = (mark_modifier(obj), sinew_modifier(obj), neutral_modifier(obj))
    return [modifier for modifier in own if modifier is not None]


def helping_modifiers(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Returns those of Sinew's modifiers that change nothing (undeformed.py)."""
    helping = (mark_modifier(obj), neutral_modifier(obj))
    return [modifier for modifier in helping if modifier is not None]


def _is_ours(obj: bpy.types.Object, modifier: bpy.types.NodesModifier) -> bool:
    return modifier.name.startswith("Sinew") or (
        properties.has_sinew(obj) and properties.of(obj).stack.modifier_uid == modifier.persistent_uid
    )


def armature_modifier(obj: bpy.types.Object) -> bpy.types.ArmatureModifier | None:
    """Returns the first Armature modifier that Sinew replaces, or would replace."""
    return next(iter(armature_modifiers(obj)), None)


def armature_modifiers(obj: bpy.types.Object) -> list[bpy.types.ArmatureModifier]:
    """Returns the Armature modifiers that Sinew replaces, or would replace: the first and those directly
    behind it, which Blender may chain as Multi Modifiers."""
    own, run = own_modifiers(obj), []
    for modifier in list(obj.modifiers)[_start(obj, own) :]:
        if modifier.type == "ARMATURE":
            run.append(modifier)
        elif modifier not in own:
            break
    return run


def _start(obj: bpy.types.Object, own: list[bpy.types.Modifier]) -> int:
    """Returns the index of the first Armature modifier that Sinew replaces. Without Sinew, that is the first
    with an armature, preferably one that is on."""
    modifiers = list(obj.modifiers)
    if not properties.has_sinew(obj):
        candidates = [m for m in modifiers if m.type == "ARMATURE" and m.object is not None]
        return _index(obj, min(candidates, key=lambda m: not can_be_on(obj, m), default=None))
    behind_own = max((_index(obj, modifier) for modifier in own), default=len(modifiers)) + 1
    found = [modifier_of(obj, replaced) for replaced in properties.of(obj).replaced_modifiers]
    known = sorted(_index(obj, modifier) for modifier in found if modifier is not None)
    start = next(iter(known), behind_own)
    # New modifiers between Sinew's and the first known one count.
    between = modifiers[behind_own:start]
    if between and all(m.type == "ARMATURE" for m in between):
        start = behind_own
    # So do new ones directly before Sinew's or before the first.
    ahead = min(start, len(modifiers)) - 1
    while ahead >= 0 and modifiers[ahead] in own:
        ahead -= 1
    # So do others in place of those that are gone, if Sinew's is behind them.
    while ahead >= 0 and (_deforms(modifiers[ahead]) or (not known and modifiers[ahead].type == "ARMATURE")):
        start, ahead = ahead, ahead - 1
    return start


def modifier_of(
    obj: bpy.types.Object,
    replaced: properties.SinewReplacedModifier | properties.SinewSwitchedOff,
    kind: str = "ARMATURE",
) -> bpy.types.Modifier | None:
    """Returns the modifier of this type that was replaced, even if it was moved and renamed; else one of its
    name."""
    found = [modifier for modifier in obj.modifiers if modifier.type == kind]
    same = (m for m in found if m.persistent_uid == replaced.uid)
    return next(same, None) or next((m for m in found if m.name == replaced.name), None)


def _deforms(modifier: bpy.types.Modifier) -> bool:
    return modifier.type == "ARMATURE" and modifier.object is not None and is_on(modifier)


def _index(obj: bpy.types.Object, modifier: bpy.types.Modifier | None) -> int:
    return next((i for i, m in enumerate(obj.modifiers) if m == modifier), len(obj.modifiers))


def position_own(obj: bpy.types.Object) -> None:
    """Moves Sinew's modifiers behind the Armature modifiers that it replaces: it sets each vertex to its
    point regardless of the modifiers before it. In front of them or between them, even one that is off would
    decide what a Multi Modifier mixes with."""
    run = armature_modifiers(obj)
    if any(modifier.type in NEED_ORIGINAL_MESH for modifier in downstream(obj)):
        return
    for ahead, modifier in itertools.pairwise([run[-1], *own_modifiers(obj)] if run else []):
        move_behind(obj, modifier, ahead)


def move_behind(obj: bpy.types.Object, modifier: bpy.types.Modifier, other: bpy.types.Modifier) -> None:
    """Moves a modifier directly behind another one, where it is not there."""
    own, ahead = _index(obj, modifier), _index(obj, other)
    if own != ahead + 1:
        obj.modifiers.move(own, ahead if own < ahead else ahead + 1)


def visibility_is_animated(obj: bpy.types.Object) -> bool:
    """Whether an animation switches one of the Armature modifiers, or one of Sinew's, on and off."""
    modifiers = (*armature_modifiers(obj), *own_modifiers(obj))
    return any(is_visibility_animated(obj, modifier) for modifier in modifiers)


def upstream(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Returns the modifiers before those that Sinew replaces, without Sinew's own, and without those that
    Blender leaves out in the object's mode."""
    # Compared by identity, too, as it has no node group at first.
    own = own_modifiers(obj)
    ahead = list(obj.modifiers)[: _index(obj, armature_modifier(obj))]
    left_out = LEFT_OUT_IN_PAINT if obj.mode in ("WEIGHT_PAINT", "VERTEX_PAINT") else ()
    return [m for m in ahead if m not in own and not node_group.is_sinew(m) and m.type not in left_out]


def downstream(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Returns the modifiers behind those that Sinew replaces, or would replace, without Sinew's own."""
    run, own = armature_modifiers(obj), own_modifiers(obj)
    if not run and not parent_deforms(obj):
        return []
    behind = list(obj.modifiers)[_index(obj, run[-1]) + 1 :] if run else obj.modifiers
    return [modifier for modifier in behind if modifier not in own]


def upstream_changes(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Returns the upstream modifiers that are on, or may be, and change positions, topology or weights."""
    return [m for m in upstream(obj) if can_be_on(obj, m) and m.type not in HARMLESS_UPSTREAM]


def is_deformed_mesh_read(obj: bpy.types.Object) -> bool:
    """Whether Blender reads the mesh behind the leading modifiers that just deform, so without Sinew's: a
    rigid body, and brushes where a later modifier makes another mesh (sculpt_update_object in Blender's
    sources of 4.2 to 5.2)."""
    if is_deforming_body(obj):
        return True
    is_painted = obj.mode in ("WEIGHT_PAINT", "VERTEX_PAINT")
    return is_painted and any(can_be_on(obj, m) and m.type not in ONLY_DEFORM for m in downstream(obj))


def is_deforming_body(obj: bpy.types.Object) -> bool:
    """Whether it is a rigid body of source Deform, or one of any source that is Deforming
    (rigidbody_get_mesh, rigidbody_update_sim_ob in Blender's sources of 4.2 to 5.2)."""
    body = obj.rigid_body
    return body is not None and (body.mesh_source == "DEFORM" or body.use_deform)


def parent_deforms(obj: bpy.types.Object) -> bool:
    """Whether the object's parent deforms it before all modifiers (parent type Armature)."""
    return obj.parent is not None and obj.parent_type == "ARMATURE" and obj.parent.type == "ARMATURE"
