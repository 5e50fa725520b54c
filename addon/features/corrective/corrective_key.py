# SPDX-License-Identifier: GPL-3.0-or-later
"""A shape key by which the Armature modifiers alone show what Sinew shows in this pose: for a file
that is to do without Sinew, or for an engine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...attach import attach, properties, stack, upstream_proxy
from ...core.corrective import NEAR, distances, offsets
from ...core.errors import SinewError
from ...core.scale_rule import BLENDER_4
from ...core.session import Binding, SkinStack, SkinStage
from ...deform import session
from ...deform.plan import MODES_OF_THE_MODIFIER
from ...deform.skinned_object import SkinnedObject

# Of a turn of the bone, in radians: with less its key would be all or nothing.
LEAST_TURN = 0.05


@dataclass
class Made:
    """name           of the shape key
    before, after  the largest distance of the Armature modifiers' shape from Sinew's, without and with it, in
                   units of the scene
    """

    name: str
    before: float
    after: float


def add(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, bone: bpy.types.PoseBone | None) -> Made:
    """Adds the key, muted, as what Sinew shows has it already.

    bone  drives it: from 0 where it is turned against its parent as at rest, to 1 as it is now; None: its
          value is 1

    Raises SinewError, and changes nothing, where there can be none.
    """
    _check(obj)
    pairs = session.states_of([obj], depsgraph)
    if not pairs:
        raise SinewError(properties.of(obj).error or f"{obj.name}: switch Sinew on, as its shape is wanted")
    turns = None if bone is None else _turns(bone)
    wanted, rest = pairs[0][1].points.copy(), pairs[0][1].shown.rest_points
    modifiers = _Modifiers(obj, pairs[0][1])
    found, left = offsets(rest, wanted, modifiers.shape)
    before = float(distances(modifiers.shape(rest), wanted).max(initial=0.0))
    if before <= NEAR * np.linalg.norm(np.ptp(rest, axis=0)):
        raise SinewError(f"{obj.name}: its Armature modifier has the same shape in this pose")
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    method = properties.METHODS[properties.of(obj).method].label
    key = obj.shape_key_add(name=f"{method} {bpy.context.scene.frame_current}", from_mix=False)
    points = np.empty((len(found), 3), dtype=np.float32)
    key.data.foreach_get("co", points.ravel())
    key.data.foreach_set("co", (points + found).astype(np.float32).ravel())
    key.mute, key.value = True, 1.0
    if bone is not None and turns is not None:
        _drive(key, bone, *turns)
    return Made(key.name, before, float(left.max(initial=0.0)))


def _check(obj: bpy.types.Object) -> None:
    keys = obj.data.shape_keys
    if not obj.data.is_editable or obj.override_library is not None:
        raise SinewError(f"{obj.name}: its mesh comes from another file, where shape keys have to be made")
    if obj.mode in MODES_OF_THE_MODIFIER:
        raise SinewError(
            f"{obj.name}: leave its mode first, in which the Armature modifier shows its own shape"
        )
    if keys is not None and not keys.use_relative:
        raise SinewError(f"{obj.name}: its shape keys are absolute; a corrective key is a relative one")
    if upstream_proxy.is_needed(obj):
        names = ", ".join(m.name for m in stack.upstream_changes(obj)) or "its parent"
        raise SinewError(
            f"{obj.name}: {names} changes the mesh ahead of the armature, where shape keys can not follow"
        )


class _Modifiers:
    """The object's Armature modifiers, as they deform by themselves in the pose that is shown."""

    def __init__(self, obj: bpy.types.Object, skinned: SkinnedObject) -> None:
        stages = skinned.bound.skin_stack.skin_stages
        self._stack = SkinStack([SkinStage(Binding(s.binding.weighting), s.mask, s.multi) for s in stages])
        methods = [attach.method_of(modifier) for modifier, _kept in attach.replaced_modifiers(obj)]
        self._frames = [
            frame and replace(frame, method=method, mix="", parameters={}, scale_rule=BLENDER_4.name)
            for frame, method in zip(skinned.shown.frames or (), methods, strict=True)
        ]

    def shape(self, rest_points: np.ndarray) -> np.ndarray:
        """float32 [vertices, 3], object space"""
        self._stack.deform(rest_points, self._frames)
        return np.array(self._stack.points)


# --- By a bone


def _turns(bone: bpy.types.PoseBone) -> tuple[float, float]:
    """By how much it is turned against its parent at rest and now, in radians, as drivers say it."""
    if bone.parent is None:
        raise SinewError(
            f"{bone.name} has no parent: choose a bone that is turned against one to drive the key"
        )
    at_rest = bone.parent.bone.matrix_local.to_quaternion(), bone.bone.matrix_local.to_quaternion()
    now = bone.parent.matrix.to_quaternion(), bone.matrix.to_quaternion()
    rest_turn, turn = (a.rotation_difference(b).angle for a, b in (at_rest, now))
    rest_turn, turn = (min(angle, 2.0 * np.pi - angle) for angle in (rest_turn, turn))
    if abs(turn - rest_turn) < LEAST_TURN:
        raise SinewError(
            f"{bone.name} is turned against its parent as at rest: pose it to drive the key by it"
        )
    return rest_turn, turn


def _drive(key: bpy.types.ShapeKey, bone: bpy.types.PoseBone, rest_turn: float, turn: float) -> None:
    curve = key.driver_add("value")
    driver = curve.driver
    driver.type = "AVERAGE"
    variable = driver.variables.new()
    variable.name, variable.type = "turn", "ROTATION_DIFF"
    for target, each in zip(variable.targets, (bone.parent, bone), strict=True):
        target.id, target.bone_target = bone.id_data, each.name
    # The one that Blender makes multiplies what the keys say.
    for modifier in list(curve.modifiers):
        curve.modifiers.remove(modifier)
    for at, value in sorted(((rest_turn, 0.0), (turn, 1.0))):
        curve.keyframe_points.insert(at, value).interpolation = "LINEAR"
