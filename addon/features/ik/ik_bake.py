# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes Sinew's inverse kinematics to plain keys in a copy of the action, in place of Blender's
constraints."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...base.errors import SinewError
from ...deform import characters
from ...io import actions, ik_io, pose_io, spaces
from ...skinning import ik as core
from ..action_copy import action_copy


@dataclass
class Baked:
    """The result of baking a tree: `errors` [frames], of the tips, in lengths of the chain."""

    tree: core.Tree
    errors: np.ndarray


def steps(
    armature: bpy.types.Object, trees: Sequence[core.Tree], frames: Sequence[int]
) -> Generator[float, None, list[Baked]]:
    """Bakes trees, those nearest to the root first; yields the progress.

    At the end the armature plays a copy of its action with keys of the bones' rotations at every frame, with
    linear interpolation, and the constraints are muted; keys at other frames stay. If closed before the end,
    everything is as before. The caller restores the scene's frame. Raises SinewError where the armature
    cannot be keyed.
    """
    _check_not_switched(armature, trees)
    found = []
    with action_copy.playing(armature, "Sinew IK") as muted:
        for number, tree in enumerate(trees):
            ik_io.set_muted(armature, tree.constraints, True)
            muted += tree.constraints
            posed = []
            for frame in frames:
                characters.set_frame(bpy.context.scene, frame)
                posed.append(ik_io.read_posed(armature, tree))
                yield (number + len(posed) / len(frames)) / len(trees)
            found.append(_bake(armature, tree, core.stack(posed), frames))
    return found


def _check_not_switched(armature: bpy.types.Object, trees: Sequence[core.Tree]) -> None:
    """Raises SinewError where keys or drivers switch a tree's constraints, which the bake mutes."""
    animation = armature.animation_data
    if animation is None:
        return
    muting = set()
    for tree in trees:
        for bone, name in tree.constraints:
            owner, constraint = map(bpy.utils.escape_identifier, (bone, name))
            path = f'pose.bones["{owner}"].constraints["{constraint}"]'
            muting |= {f"{path}.mute", f"{path}.enabled"}
    curves = [*actions.all_curves(animation.action, actions.slot_of(animation)), *animation.drivers]
    for curve in curves:
        if curve.data_path in muting:
            raise SinewError(
                f"{armature.name}: keys or a driver switch a constraint on and off ({curve.data_path}); key "
                "its influence instead"
            )


def _bake(
    armature: bpy.types.Object,
    tree: core.Tree,
    posed: core.Posed,
    frames: Sequence[int],
) -> Baked:
    problem = core.problem_of(tree, posed)
    solution = core.solve(tree, problem)
    rotations = core.blended(tree, problem, solution.rotations, posed.influences)
    matrices = core.matrices_of(tree, problem, rotations)
    for number, name in enumerate(tree.bones):
        bone = armature.pose.bones[name]
        parent = tree.parents[number]
        before = posed.parent if parent < 0 else matrices[:, parent]
        channels = spaces.channels_from_poses(bone.bone, matrices[:, number], before)
        _write_keys(armature, name, np.array([each.to_quaternion() for each in channels]), frames)
    return Baked(tree, core.tip_errors(tree, problem, matrices))


def _write_keys(
    armature: bpy.types.Object, name: str, quaternions: np.ndarray, frames: Sequence[int]
) -> None:
    bone = armature.pose.bones[name]
    row = armature.pose.bones.find(name)
    mode = np.array([bone.rotation_mode])
    near = pose_io.read_channels(armature.pose.bones)[row : row + 1]
    scale = pose_io.poses_of(near, mode).scale
    values = np.empty((len(frames), pose_io.CHANNELS))
    for number, quaternion in enumerate(quaternions):
        rigid = np.concatenate([quaternion, np.zeros(3)])[None]
        near = pose_io.channels_of(pose_io.Poses(rigid, scale), mode, near)
        values[number] = near[0]
    path = pose_io.ROTATION_PROPERTIES.get(bone.rotation_mode, "rotation_euler")
    # Makes the action, its slot and the curves in each version's way.
    bone.keyframe_insert(path, frame=frames[0], group=name)
    animation = armature.animation_data
    for curve, channel in actions.bone_curves(animation.action, actions.slot_of(animation))[name]:
        if channel.property == path:
            actions.write_keys(curve, frames, values[:, channel.column])
            for modifier in curve.modifiers:
                modifier.mute = True
            curve.mute = False
