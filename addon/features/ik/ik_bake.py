# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes Sinew's inverse kinematics to plain keys in a separate action, which plays without Sinew, in place of
Blender's constraints; and restores these."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...attach import properties
from ...core import ik as core
from ...core.errors import SinewError
from ...core.inbetween import BLENDER
from ...deform import evaluate
from ...io import actions, ik_io, pose_io
from .ik_checks import check_not_switched


class SinewIkBake(bpy.types.PropertyGroup):
    """What a bake replaced: see restore()."""

    is_on: bpy.props.BoolProperty(description="Whether keys of Sinew IK play")
    before: bpy.props.PointerProperty(type=bpy.types.Action, description="The action before the bake")
    baked: bpy.props.PointerProperty(type=bpy.types.Action, description="The action with the baked keys")
    # JSON: a list of [bone, constraint]; and channels by bone, as from pose_io.read_channels().
    muted: bpy.props.StringProperty(description="The IK constraints that the bake muted")
    channels: bpy.props.StringProperty(description="The pose before the bake")


@dataclass
class Baked:
    """The result of baking a tree: `errors` [frames], of the tips, in lengths of the chain."""

    tree: core.Tree
    solution: core.ik.Solution
    errors: np.ndarray


def register() -> None:
    bpy.types.Object.sinew_ik_bake = bpy.props.PointerProperty(
        type=SinewIkBake, override=properties.OVERRIDABLE
    )


def unregister() -> None:
    del bpy.types.Object.sinew_ik_bake


def is_baked(armature: bpy.types.Object) -> bool:
    return armature.type == "ARMATURE" and armature.sinew_ik_bake.is_on


def steps(
    armature: bpy.types.Object,
    trees: Sequence[core.Tree],
    frames: Sequence[int],
    method: core.ik.Method,
    found: list[Baked],
) -> Iterator[float]:
    """Bakes trees, those nearest to the root first; yields the progress.

    At the end the armature plays a copy of its action with keys of the bones' rotations at every frame, with
    linear interpolation, and the constraints are muted; keys at other frames stay. If closed before the end,
    everything is as before. The caller restores the scene's frame, and suspends live trees (ik_live): baked
    ones are not live any more. Raises SinewError where the armature cannot be keyed.
    """
    _check(armature, trees)
    record = armature.sinew_ik_bake
    animation = armature.animation_data
    action = animation.action if animation is not None else None
    slot_handle = actions.handle_of(actions.slot_of(animation)) if animation is not None else 0
    channels = pose_io.read_channels(armature.pose.bones)
    muted: list[tuple[str, str]] = []
    is_done = False
    copy = None
    try:
        copy = _own_action(armature, action, slot_handle)
        for number, tree in enumerate(trees):
            ik_io.set_muted(armature, tree.constraints, True)
            muted += tree.constraints
            posed = []
            for frame in frames:
                evaluate.set_frame(bpy.context.scene, frame)
                posed.append(ik_io.read_posed(armature, tree))
                yield (number + len(posed) / len(frames)) / len(trees)
            found.append(_bake(armature, tree, core.stack(posed), frames, method))
        is_done = True
    finally:
        if not is_done:
            ik_io.set_muted(armature, muted, False)
            _play(armature, action, slot_handle)
            if copy is not None and copy is not action:
                bpy.data.actions.remove(copy)
            pose_io.write_channels(armature.pose.bones, channels)
            found.clear()
    if not record.is_on:
        record.before = action
        record.channels = json.dumps(
            {bone.name: row for bone, row in zip(armature.pose.bones, channels.tolist(), strict=True)}
        )
    record.muted = json.dumps([*json.loads(record.muted or "[]"), *muted])
    for bone, _name in muted:
        armature.pose.bones[bone].property_unset("sinew_ik_live")
    earlier = record.baked
    record.is_on, record.baked = True, armature.animation_data.action
    if earlier is not None and not earlier.users:
        bpy.data.actions.remove(earlier)


def restore(armature: bpy.types.Object) -> None:
    """Restores what steps() replaced: the action, the poses that it did not key, the constraints."""
    record = armature.sinew_ik_bake
    baked, animation = record.baked, armature.animation_data
    if animation is not None and (animation.action == baked or baked is None):
        handle = actions.handle_of(actions.slot_of(animation))
        _play(armature, record.before, handle)
        _set_channels(armature, json.loads(record.channels or "{}"))
    ik_io.set_muted(armature, [tuple(pair) for pair in json.loads(record.muted or "[]")], False)
    record.is_on = False
    record.before = record.baked = None
    record.muted = record.channels = ""
    if baked is not None and not baked.users:
        bpy.data.actions.remove(baked)


def _check(armature: bpy.types.Object, trees: Sequence[core.Tree]) -> None:
    if not armature.is_editable:
        raise SinewError(
            f"{armature.name} is linked: make a library override first (Object > Library Override)"
        )
    if armature.sinew_inbetween != BLENDER:
        raise SinewError(
            f"{armature.name}: Sinew plays its in-betweens; bake these first, or switch them off"
        )
    animation = armature.animation_data
    if animation is None:
        return
    if animation.action_blend_type != "REPLACE" or animation.action_influence != 1.0:
        raise SinewError(
            f"{armature.name}: its action is mixed with NLA strips; set its blending to Replace and its "
            "influence to 1, or bake the strips into one action (Object > Animation > Bake Action)"
        )
    if animation.use_tweak_mode:
        raise SinewError(f"{armature.name} is tweaking an NLA strip: leave tweak mode first (Tab)")
    check_not_switched(armature, trees)


def _own_action(
    armature: bpy.types.Object, action: bpy.types.Action | None, handle: int
) -> bpy.types.Action | None:
    """Makes the armature play a copy of the action, and returns it; None where it has none, as the first key
    makes one."""
    if action is None:
        return None
    copy = action.copy()
    copy.name = f"{action.name} Sinew IK"
    _play(armature, copy, handle)
    return copy


def _play(armature: bpy.types.Object, action: bpy.types.Action | None, handle: int) -> None:
    animation = armature.animation_data
    if animation is None:
        return
    animation.action = action
    slots = getattr(action, "slots", ())
    slot = next((each for each in slots if each.handle == handle), None)
    if slot is not None:
        animation.action_slot = slot


def _bake(
    armature: bpy.types.Object,
    tree: core.Tree,
    posed: core.Posed,
    frames: Sequence[int],
    method: core.ik.Method,
) -> Baked:
    problem = core.problem_of(tree, posed)
    solution = core.solve(tree, problem, method)
    rotations = core.blended(tree, problem, solution.rotations, posed.influences)
    matrices = core.matrices_of(tree, problem, rotations)
    for number, name in enumerate(tree.bones):
        bone = armature.pose.bones[name]
        parent = tree.parents[number]
        before = posed.parent if parent < 0 else matrices[:, parent]
        _write_keys(armature, name, ik_io.local_rotations(bone, matrices[:, number], before), frames)
    return Baked(tree, solution, core.tip_errors(tree, problem, matrices))


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
            _replace_keys(curve, frames, values[:, channel.column])


def _replace_keys(curve: bpy.types.FCurve, frames: Sequence[int], values: np.ndarray) -> None:
    """Replaces all keys from the first to the last of `frames` by keys at `frames`; those outside stay."""
    points = curve.keyframe_points
    for point in reversed([point for point in points if frames[0] <= point.co.x <= frames[-1]]):
        points.remove(point, fast=True)
    kept = len(points)
    points.add(len(frames))
    kinds = np.empty(len(points), np.int32)
    keys = np.empty(2 * len(points), np.float32)
    points.foreach_get("interpolation", kinds)
    points.foreach_get("co", keys)
    kinds[kept:] = actions.key_value("interpolation", "LINEAR")
    keys[2 * kept :] = np.column_stack([frames, values]).ravel()
    points.foreach_set("interpolation", kinds)
    points.foreach_set("co", keys)
    for modifier in curve.modifiers:
        modifier.mute = True
    curve.mute = False
    curve.update()


def _set_channels(armature: bpy.types.Object, saved: dict[str, list[float]]) -> None:
    channels = pose_io.read_channels(armature.pose.bones)
    for row, bone in enumerate(armature.pose.bones):
        if bone.name in saved:
            channels[row] = saved[bone.name]
    pose_io.write_channels(armature.pose.bones, channels)
