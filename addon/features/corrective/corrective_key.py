# SPDX-License-Identifier: GPL-3.0-or-later
"""A shape key with which the Armature modifiers alone show Sinew's shape in this pose, for files without
Sinew, or for an engine."""

from collections.abc import Callable

import bpy
import numpy as np

from ...attach import properties, upstream_proxy
from ...base.errors import SinewError
from ...deform import pose, session
from ...deform.plan import ARMATURE_MODIFIER_MODES
from ...deform.skinned_object import SkinnedObject
from ...skinning.arrays import read
from .offsets import NEAR, offsets

# The bone's smallest rotation, in radians: below it, the key would be all or nothing.
LEAST_TURN = 0.05


def add(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, bone: bpy.types.PoseBone | None
) -> tuple[str, float, float]:
    """Adds the key, muted, as Sinew already shows this shape. Returns its name, and the largest distance of
    the Armature modifiers' shape from Sinew's, without and with it, in scene units.

    bone  drives the key: its value is 0 where the bone is rotated relative to its parent as at rest, and 1 in
          the current pose; None: its value is 1

    Raises SinewError, and changes nothing, where a key is not possible.
    """
    _check(obj)
    pairs = session.deformed_now([obj], depsgraph)
    if not pairs:
        raise SinewError(properties.of(obj).error or f"{obj.name}: switch Sinew on, as its shape is wanted")
    turns = None if bone is None else _turns(bone)
    skinned = pairs[0][1]
    rest = skinned.shown.rest_points
    found, without, left = offsets(rest, skinned.points, _by_modifiers(obj, skinned))
    before = float(without.max(initial=0.0))
    if not len(rest) or before <= NEAR * np.linalg.norm(np.ptp(rest, axis=0)):
        raise SinewError(f"{obj.name}: its Armature modifier has the same shape in this pose")
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    method = properties.METHODS[properties.of(obj).method].label
    key = obj.shape_key_add(name=f"{method} {bpy.context.scene.frame_current}", from_mix=False)
    key.data.foreach_set("co", (read(key.data, "co", 3) + found).astype(np.float32).ravel())
    key.mute, key.value = True, 1.0
    if bone is not None and turns is not None:
        _drive(key, bone, *turns)
    return key.name, before, float(left.max(initial=0.0))


def _check(obj: bpy.types.Object) -> None:
    keys = obj.data.shape_keys
    if not obj.data.is_editable or obj.override_library is not None:
        raise SinewError(f"{obj.name}: its mesh comes from another file, where shape keys have to be made")
    if obj.mode in ARMATURE_MODIFIER_MODES:
        raise SinewError(f"{obj.name}: leave its mode first, in which the Armature modifier deforms it")
    if keys is not None and not keys.use_relative:
        raise SinewError(f"{obj.name}: its shape keys are absolute; a corrective key is a relative one")
    upstream_proxy.check_not_needed(obj, "where shape keys can not follow")


def _by_modifiers(obj: bpy.types.Object, skinned: SkinnedObject) -> Callable[[np.ndarray], np.ndarray]:
    """Returns a function from rest points, float32 [vertices, 3], to the shape that the object's Armature
    modifiers give them in the current pose."""
    skin_stack = skinned.bound.skin_stack.another()
    frames = pose.of_modifiers(obj, skinned.shown.frames or [])

    def shape(rest_points: np.ndarray) -> np.ndarray:
        skin_stack.deform(rest_points, frames)
        return np.array(skin_stack.points)

    return shape


# --- By a bone


def _turns(bone: bpy.types.PoseBone) -> tuple[float, float]:
    """Returns the angles of its rotation relative to its parent at rest and now, in radians, as drivers
    measure them."""
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
    # Blender's default modifier would multiply the keys' values.
    for modifier in list(curve.modifiers):
        curve.modifiers.remove(modifier)
    for at, value in sorted(((rest_turn, 0.0), (turn, 1.0))):
        curve.keyframe_points.insert(at, value).interpolation = "LINEAR"
