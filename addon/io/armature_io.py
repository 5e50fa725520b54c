# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads bones and poses from Blender, in Sinew's conventions: row-major matrices, armature space."""

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ..skinning.arrays import read
from ..skinning.envelopes import Envelopes
from ..skinning.rig import Bones
from ..skinning.twist_spread import NOT_TOLD, TwistInputs

_CURVED = bpy.types.Bone.bl_rna.properties["bbone_mapping_mode"].enum_items["CURVED"].value
# Of axes of unit length: less is the rounding of poses.
_SHEAR = 1e-5
# The determinant of a bone without size.
_FLAT = 1e-20


def read_current_bones(armature: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Bones:
    """Returns the rest bones of an armature object in this evaluation; where it was given other data since,
    the bones of these, as its next evaluation has them."""
    evaluated = armature.evaluated_get(depsgraph)
    is_current = evaluated.data.session_uid == armature.data.session_uid
    return read_bones(evaluated if is_current else armature)


def read_bones(evaluated_armature: bpy.types.Object) -> Bones:
    """Returns the rest bones of an evaluated armature object, in the order of its pose, and the joints of
    bendy bones."""
    bones = evaluated_armature.data.bones
    segments = read(bones, "bbone_segments", kind=np.int32)
    rest = _read_matrices(bones, "matrix_local")
    first_joints = np.full(len(bones), -1, dtype=np.int32)
    parts, count, complete = [rest], len(bones), True
    for bone in np.flatnonzero(segments > 1):
        try:
            joints = _read_joints(evaluated_armature, rest, [(int(bone), int(segments[bone]))], at_rest=True)
        except RuntimeError:
            # Blender has not evaluated this pose, as in a view layer that does not show it.
            segments[bone], complete = 1, False
            continue
        first_joints[bone] = count
        parts.append(joints)
        count += segments[bone] + 1
    return Bones(
        tuple(bones.keys()),
        read(bones, "use_deform", kind=bool),
        np.concatenate(parts),
        read(bones, "length"),
        segments,
        read(bones, "bbone_mapping_mode", kind=np.int32) == _CURVED,
        first_joints,
        _read_envelopes(bones),
        _read_parents(bones),
        complete,
    )


def paths_to_wait_for(armature: bpy.types.Object, names: Sequence[str]) -> list[str]:
    """Returns properties of an armature object that Blender, for a driver, reads only after it has posed all
    of `names`, including the joints of bendy bones and the bones that shape these."""
    bones = armature.data.bones
    # In edit mode, bones in `names` may no longer exist.
    names = [name for name in names if name in bones]
    bendy = [name for name in names if bones[name].bbone_segments > 1]
    wanted = dict.fromkeys([*names, *_handles_of(armature, bendy)])
    above = set()
    for name in wanted:
        parent = bones[name].parent
        # The parents of a bone that was already reached are known.
        while parent is not None and parent.name not in above:
            above.add(parent.name)
            parent = parent.parent
    # A bone is posed after its parents, but joints only later, and only bendy-bone properties wait for them.
    return [
        *(f"{_path(name)}.length" for name in wanted if name not in above),
        *(f"{_path(name)}.bbone_curveinx" for name in bendy),
    ]


def _path(name: str) -> str:
    return f'pose.bones["{bpy.utils.escape_identifier(name)}"]'


def _handles_of(armature: bpy.types.Object, names: Sequence[str]) -> list[str]:
    """Returns the bones that shape bendy bones: their handles, which are neighbours or chosen bones."""
    handles = []
    for name in names:
        bone = armature.data.bones[name]
        chosen = (bone.bbone_custom_handle_start, bone.bbone_custom_handle_end, bone.parent)
        handles += [b.name for b in (*chosen, *bone.children) if b is not None]
    return sorted(set(handles))


def read_pose(evaluated_armature: bpy.types.Object, bones: Bones) -> np.ndarray:
    """Returns float32 [bones + joints, 4, 4]: each posed bone in armature space, then the joints of
    `bones`."""
    pose = _read_matrices(evaluated_armature.pose.bones, "matrix")
    if not bones.bend:
        return pose
    return np.concatenate([pose, _read_joints(evaluated_armature, pose, bones.bending, at_rest=False)])


def _read_envelopes(bones: bpy.types.bpy_prop_collection) -> Envelopes:
    return Envelopes(
        heads=read(bones, "head_local", 3),
        tails=read(bones, "tail_local", 3),
        head_radii=read(bones, "head_radius"),
        tail_radii=read(bones, "tail_radius"),
        distances=read(bones, "envelope_distance"),
        weights=read(bones, "envelope_weight"),
        multiply=read(bones, "use_envelope_multiply", kind=bool),
    )


def _read_parents(bones: bpy.types.bpy_prop_collection) -> np.ndarray:
    numbers = {bone: number for number, bone in enumerate(bones)} | {None: -1}
    return np.array([numbers[bone.parent] for bone in bones], dtype=np.int32).reshape(-1)


def read_twists(evaluated_armature: bpy.types.Object, bones: Bones) -> TwistInputs:
    """Returns the inputs of the stage twist_spread, from the properties and channels of pose bones."""
    pose_bones, inputs = evaluated_armature.pose.bones, []
    for name, tip in zip(bones.twists.bones, bones.twists.tips, strict=True):
        bone = pose_bones[name]
        inputs.append((bone.sinew_twist_amount, bone.sinew_twist_curve, *_turns_told(pose_bones[tip])))
    return tuple(inputs)


def read_turns(evaluated_armature: bpy.types.Object, bones: Bones) -> np.ndarray | None:
    """Returns float32 [bones, 4]: the rotation against its parent, in armature space, of each bone whose own
    Euler angles or axis and angle may go beyond half a turn, as sinew.Deformer.deform takes it. None where
    there is none."""
    pose_bones, count = evaluated_armature.pose.bones, len(bones.names)
    modes = read(pose_bones, "rotation_mode", kind=np.int32)
    eulers, around_axes = read(pose_bones, "rotation_euler", 3), read(pose_bones, "rotation_axis_angle", 4)
    # Three angles of at most a quarter of a turn do not add up to more than half.
    by_euler = (modes > 0) & (np.abs(eulers).max(axis=1) > np.pi / 2)
    by_axis = (modes < 0) & (np.abs(around_axes[:, 0]) > np.pi / 2)
    turns = np.zeros((count, 4), np.float32)
    for bone in np.flatnonzero(by_euler | by_axis):
        told = _rotation_told(pose_bones[bone])
        turns[bone] = told[0], *(bones.rest[bone, :3, :3] @ told[1:])
    return turns if turns.any() else None


def _rotation_told(bone: bpy.types.PoseBone) -> np.ndarray:
    """Returns the rotation of a bone's channels as (w, x, y, z), where w < 0 is the longer way."""
    if bone.rotation_mode != "AXIS_ANGLE":
        return np.array(bone.rotation_euler.to_quaternion())
    angle, *axis = bone.rotation_axis_angle
    # A Quaternion of mathutils would take the shorter way.
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * Vector(axis).normalized())])


def decomposed(pose: np.ndarray, parents: np.ndarray) -> np.ndarray:
    """Returns a pose in which each bone has a translation, a rotation and a scale against its parent, as
    engines store it: what shears a bone against its parent is lost.

    pose     float32 [bones + joints, 4, 4], armature space
    parents  int32 [bones], each of which precedes its children
    """
    count = len(parents)
    above = np.where((parents >= 0)[:, None, None], pose[parents], np.identity(4)).astype(np.float64)
    # A bone without size hides what it carries.
    is_flat = np.abs(np.linalg.det(above[:, :3, :3])) < _FLAT
    above[is_flat] = np.identity(4)
    local = np.linalg.inv(above) @ pose[:count]
    axes = local[:, :3, :3]
    lengths = np.linalg.norm(axes, axis=1)
    unit = axes / np.where(lengths == 0.0, 1.0, lengths)[:, None]
    across = np.abs(unit.swapaxes(1, 2) @ unit * (1.0 - np.identity(3))).max(axis=(1, 2))
    is_sheared = (across > _SHEAR) & ~is_flat
    if not is_sheared.any():
        return pose
    for bone in np.flatnonzero(is_sheared):
        # As Blender's exporters do it.
        local[bone] = Matrix.LocRotScale(*Matrix(local[bone].tolist()).decompose())
    result = pose.astype(np.float64)
    for bone, parent in enumerate(parents):
        if parent >= 0 and not is_flat[bone]:
            result[bone] = result[parent] @ local[bone]
        elif is_sheared[bone]:
            result[bone] = local[bone]
    return result.astype(np.float32)


def ik_limits(bone: bpy.types.PoseBone) -> np.ndarray:
    """Returns float64 [3, 2]: the least and the largest rotation about each axis that inverse kinematics has,
    in radians; NaN where it is free."""
    found = np.full((3, 2), np.nan)
    for axis, letter in enumerate("xyz"):
        if getattr(bone, f"lock_ik_{letter}"):
            found[axis] = 0.0
        elif getattr(bone, f"use_ik_limit_{letter}"):
            found[axis] = getattr(bone, f"ik_min_{letter}"), getattr(bone, f"ik_max_{letter}")
    return found


def read_limits(armature: bpy.types.Object) -> dict[str, np.ndarray]:
    """Returns the limits of rotation of each bone that has some, as battery.Limits: those of inverse
    kinematics, or of a Limit Rotation in its own space."""
    limits = {}
    for bone in armature.pose.bones:
        found = ik_limits(bone)
        constraints = [each for each in bone.constraints if each.type == "LIMIT_ROTATION" and not each.mute]
        for axis, letter in enumerate("xyz"):
            for each in constraints:
                if each.owner_space == "LOCAL" and getattr(each, f"use_limit_{letter}"):
                    found[axis] = getattr(each, f"min_{letter}"), getattr(each, f"max_{letter}")
        if not np.isnan(found).all():
            limits[bone.name] = found
    return limits


def _turns_told(bone: bpy.types.PoseBone) -> tuple[float, ...]:
    """Returns the rotation of a bone's channels, and the angles that they give beyond half a turn."""
    mode = bone.rotation_mode
    if mode == "QUATERNION":
        return NOT_TOLD
    if mode == "AXIS_ANGLE":
        angle, *axis = bone.rotation_axis_angle
        direction = Vector(axis).normalized()
        return (*Quaternion(direction, angle), *(angle * direction))
    euler = bone.rotation_euler
    return (*euler.to_quaternion(), *euler)


def _read_matrices(bones: bpy.types.bpy_prop_collection, name: str) -> np.ndarray:
    # Blender stores matrices by columns.
    return read(bones, name, 16).reshape(-1, 4, 4).transpose(0, 2, 1)


class NotPosedError(Exception):
    """Blender evaluated an armature without its pose, as for its place alone."""


def _read_joints(
    evaluated_armature: bpy.types.Object,
    matrices: np.ndarray,
    bending: Sequence[tuple[int, int]],
    at_rest: bool,
) -> np.ndarray:
    """Returns float32 [joints, 4, 4]: the joints of bendy bones in armature space.

    matrices  of the bones in armature space
    bending   the index of each bendy bone and its number of segments

    Raises NotPosedError.
    """
    pose_bones, owners, flat = evaluated_armature.pose.bones, [], []
    for bone, segments in bending:
        joint = pose_bones[bone].bbone_segment_matrix
        for k in range(segments + 1):
            try:
                rows = joint(k, rest=at_rest)
            except RuntimeError as error:
                raise NotPosedError(str(error)) from error
            # Unpacking a matrix is faster than having numpy read it.
            for row in rows:
                flat.extend(row)
        owners += [bone] * (segments + 1)
    joints = np.array(flat, dtype=np.float64).reshape(-1, 4, 4)
    return (matrices[owners].astype(np.float64) @ joints).astype(np.float32)
