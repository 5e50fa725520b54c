# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds helper bones to an armature, and writes their keys and the weights of a mesh that has them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Matrix

from ...base.names import CENTRE, HELPER, SEGMENT
from ...io import actions, armature_io, mesh_io, spaces
from ...skinning.bendy import points_of_joints
from ...skinning.rig import Bones
from .helper_bones import Blend
from .pose_samples import Joints

COLLECTION = "Sinew helpers"
# Attributes of a baked mesh: each vertex's rms error, after the bake and before it.
ERRORS, ERRORS_BEFORE = "Sinew bake error", "Sinew bake error before"
# Blender's limit for a bone's name, in bytes.
_LONGEST_NAME = 63
# Share of the length of the parent bone.
_LENGTH = 0.25


def read_joints(rig: bpy.types.Object, bones: Bones) -> Joints:
    """Returns how far its bones may rotate: the limits of inverse kinematics, where they are set."""
    limits = np.array([armature_io.ik_limits(rig.pose.bones[name]) for name in bones.names])
    return Joints(bones.rest[: len(bones.names)], bones.parents, limits)


def add_bones(
    rig: bpy.types.Object,
    parents: Sequence[str],
    heads: np.ndarray,
    hanging: bool = True,
    kind: str = HELPER,
    axes: np.ndarray | None = None,
) -> list[str]:
    """Gives an armature object a bone for each of the `parents`. Returns their names.

    heads    float [helpers, 3], armature space
    hanging  whether each becomes the child of its parent, or else has none
    kind     how their names begin; a CENTRE moves helpers, the others vertices
    axes     float [helpers, 4, 4], armature space; None: those of the parents
    """
    names = []
    with _editing(rig) as armature:
        collection = armature.collections.get(COLLECTION) or armature.collections.new(COLLECTION)
        for number, (parent_name, head) in enumerate(zip(parents, heads, strict=True)):
            parent = armature.edit_bones[parent_name]
            bone = armature.edit_bones.new(_free_name(armature, kind, parent_name))
            bone.head, bone.tail = (0.0, 0.0, 0.0), (0.0, _LENGTH * parent.length, 0.0)
            placed = (parent.matrix if axes is None else Matrix(axes[number])).to_3x3().to_4x4()
            placed.translation = head
            bone.matrix = placed
            bone.parent, bone.use_connect = parent if hanging else None, False
            bone.use_deform = kind != CENTRE
            # The motion is rigid except for the parent's size.
            bone.inherit_scale = "AVERAGE"
            collection.assign(bone)
            names.append(bone.name)
    for name in names:
        rig.pose.bones[name].rotation_mode = "QUATERNION"
    return names


def add_segments(
    rig: bpy.types.Object, bones: Bones, bendy: np.ndarray, hanging: Sequence[bool] | None = None
) -> dict[int, str]:
    """Gives an armature object a plain bone for each joint of bendy bones. Returns their names, by the index
    of the joint in `bones`.

    hanging  whether those of each bendy bone are its children, and are given keys; None: they have no
             parents, and constraints have them follow the joints
    """
    names: dict[int, str] = {}
    for number, bone in enumerate(bendy):
        name, joints = bones.names[bone], np.flatnonzero(bones.owners == bone)[1:]
        rest = bones.rest[joints]
        # Where the Armature constraint, as the modifier does, takes this joint's motion alone.
        heads = rest[:, :3, 3]
        if hanging is None:
            own = bones.rest[bone], float(bones.lengths[bone]), bool(bones.curved[bone])
            heads = points_of_joints(rest, *own)
        is_child = hanging is not None and hanging[number]
        made = add_bones(rig, [name] * len(joints), heads, is_child, SEGMENT, bones.rest_axes[joints])
        names.update(zip(map(int, joints), made, strict=True))
        for segment in made if hanging is None else ():
            target = rig.pose.bones[segment].constraints.new("ARMATURE").targets.new()
            target.target, target.subtarget = rig, name
    return names


def without_shear(motions: np.ndarray, bones: Bones, joints: np.ndarray) -> np.ndarray:
    """Returns `motions` [bones + joints, 4, 4], from rest, where the poses of some joints have what keys
    have: a location, a rotation and a scale."""
    result = motions.copy()
    for joint, rest in zip(joints, bones.rest_axes[joints].astype(np.float64), strict=True):
        to_rest = np.linalg.inv(rest)
        channels = Matrix(to_rest @ motions[joint] @ rest).decompose()
        result[joint] = rest @ np.array(Matrix.LocRotScale(*channels)) @ to_rest
    return result


def use_copy_of_armature(rig: bpy.types.Object) -> None:
    """Gives the object its own copy of the armature; the one without helper bones stays in the file."""
    if rig.data.library is None:
        rig.data.use_fake_user = True
    rig.data = rig.data.copy()


def _free_name(armature: bpy.types.Armature, kind: str, parent: str) -> str:
    number = 1
    while True:
        end = f"_{number}"
        start = f"{kind}_{parent}".encode()[: _LONGEST_NAME - len(end)].decode(errors="ignore")
        if start + end not in armature.edit_bones:
            return start + end
        number += 1


def add_constraints(
    rig: bpy.types.Object, names: Sequence[str], blends: Sequence[Blend], bones: Sequence[str]
) -> None:
    """Has each helper bone follow the pose of the armature's own bones. Where a helper's head is a centre, a
    second bone there blends linearly; it moves no vertices.

    bones  names of the bones that the blends refer to
    """
    for name, blend in zip(names, blends, strict=True):
        _blend(rig, name, blend, bones, preserve_volume=True)
    centred = [(name, blend) for name, blend in zip(names, blends, strict=True) if blend.is_centre]
    parents = [bones[blend.bones[blend.weights.argmax()]] for _name, blend in centred]
    heads = np.array([blend.head for _name, blend in centred])
    centres = add_bones(rig, parents, heads, False, CENTRE)
    for (name, blend), centre in zip(centred, centres, strict=True):
        _blend(rig, centre, blend, bones, preserve_volume=False)
        follow = rig.pose.bones[name].constraints.new("COPY_LOCATION")
        follow.target, follow.subtarget = rig, centre


def _blend(
    rig: bpy.types.Object, name: str, blend: Blend, bones: Sequence[str], preserve_volume: bool
) -> None:
    constraint = rig.pose.bones[name].constraints.new("ARMATURE")
    constraint.use_deform_preserve_volume = preserve_volume
    for bone, weight in zip(blend.bones, blend.weights, strict=True):
        if weight > 0.0:
            target = constraint.targets.new()
            target.target, target.subtarget, target.weight = rig, bones[bone], weight


def write_keys(
    rig: bpy.types.Object,
    names: Sequence[str],
    motions: np.ndarray,
    parent_poses: np.ndarray,
    times: Sequence[float],
) -> None:
    """Writes keys of the helper bones, with linear interpolation, in a copy of the armature's action or in a
    new one; the action without them stays in the file.

    motions       float64 [times, helpers, 4, 4], armature space: from rest to posed
    parent_poses  float64 [times, helpers, 4, 4], armature space: of each helper's parent bone
    """
    _use_copy_of_action(rig)
    for number, name in enumerate(names):
        channels = _channels(rig.data.bones[name], motions[:, number], parent_poses[:, number])
        _write_curves(rig, name, channels, times)


def _use_copy_of_action(rig: bpy.types.Object) -> None:
    animation = rig.animation_data
    action = animation.action if animation is not None else None
    if action is None:
        return
    handle = actions.handle_of(actions.slot_of(animation))
    if action.library is None:
        action.use_fake_user = True
    copy = action.copy()
    copy.name = f"{action.name} Helpers"
    actions.play_by_handle(animation, copy, handle)


def _channels(bone: bpy.types.Bone, motions: np.ndarray, parent_poses: np.ndarray) -> np.ndarray:
    """Returns float64 [times, 10]: location, quaternion and scale, as in pose_io.read_channels()."""
    poses = motions @ np.array(bone.matrix_local, dtype=np.float64)
    channels = np.empty((len(motions), 10))
    for number, basis in enumerate(spaces.channels_from_poses(bone, poses, parent_poses)):
        location, rotation, scale = basis.decompose()
        channels[number] = (*location, *rotation, *scale)
        # Takes the shorter way from key to key.
        if number and channels[number, 3:7] @ channels[number - 1, 3:7] < 0.0:
            channels[number, 3:7] *= -1.0
    return channels


def _write_curves(rig: bpy.types.Object, name: str, channels: np.ndarray, times: Sequence[float]) -> None:
    bone = rig.pose.bones[name]
    has_scale = np.abs(channels[:, 7:] - 1.0).max() > 1e-5
    for path in ("location", "rotation_quaternion", *(("scale",) if has_scale else ())):
        # Makes the action, its slot and the curves in each version's way.
        bone.keyframe_insert(path, frame=times[0], group=name)
    animation = rig.animation_data
    for curve, channel in actions.bone_curves(animation.action, actions.slot_of(animation))[name]:
        actions.write_keys(curve, times, channels[:, channel.column])


def write_weights(
    obj: bpy.types.Object, bones: Bones, names: Sequence[str], slots: np.ndarray, weights: np.ndarray
) -> None:
    """Replaces a mesh object's weights of bones by these; groups without a bone are unchanged.

    bones           their groups lose their weights also where a vertex gets none: an option or a mask of the
                    modifier left these out
    names           of all bones
    slots, weights  [vertices, n]: indices into `names`, -1 for none, and their weights
    """
    used = [names[bone] for bone in np.unique(slots[slots >= 0])]
    new = [obj.vertex_groups.get(name) or obj.vertex_groups.new(name=name) for name in used]
    index = {group.name: group.index for group in new}
    group_of = np.array([index.get(name, -1) for name in names])
    before = mesh_io.read_group_weights(obj.data)
    is_of_bone = bones.of_groups([group.name for group in obj.vertex_groups]) >= 0
    # Also what an earlier bake left under the name of a new bone.
    is_of_bone[list(index.values())] = True
    ends = np.cumsum(before.counts)
    rows = {}
    for vertex, (own, values) in enumerate(zip(slots, weights, strict=True)):
        kept = range(ends[vertex] - before.counts[vertex], ends[vertex])
        row = {
            int(before.groups[entry]): float(before.weights[entry])
            for entry in kept
            if before.groups[entry] < len(is_of_bone) and not is_of_bone[before.groups[entry]]
        }
        row.update({int(group_of[bone]): float(v) for bone, v in zip(own, values, strict=True) if bone >= 0})
        rows[vertex] = row
    mesh_io.write_group_weights(obj, rows)


@contextmanager
def _editing(rig: bpy.types.Object) -> Iterator[bpy.types.Armature]:
    """Context in which only this armature object is in edit mode; afterwards modes and selection are as
    before."""
    layer = bpy.context.view_layer
    active, mode = layer.objects.active, bpy.context.mode
    of_active = active.mode if active is not None else "OBJECT"
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    selected = [obj for obj in layer.objects if obj.select_get()]
    for obj in selected:
        obj.select_set(False)
    layer.objects.active = rig
    rig.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        yield rig.data
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
        rig.select_set(False)
        for obj in selected:
            obj.select_set(True)
        layer.objects.active = active
        if of_active != "OBJECT":
            bpy.ops.object.mode_set(mode=of_active)
