# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the action of a range of motion, and puts back what it replaced.

Bones are keyed where the stated poses have them in armature space, whatever their own axes, parents and
rotation modes are. Meanwhile nothing else moves them: constraints, drivers and strips are off.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

import bpy
import numpy as np

from ...attach import properties
from ...base.errors import SinewError
from ...deform import session
from ...io import actions, armature_io, pose_io, spaces
from ...io.poses import Poses
from ...skinning.rig import Bones
from ..measure import battery, motion_range

NAME = "Range of Motion"
# From rest to a pose, and back.
STEP = 10
FIRST = 1
# What moves a bone, or switches what does.
_MOVING = re.compile(
    r'pose\.bones\[".*"\]\.(location|rotation_\w+|scale|constraints\[".*"\]\.(mute|enabled))'
)


class SinewMotionRange(bpy.types.PropertyGroup):
    """Of an armature that plays a range of motion: what restore() needs."""

    is_on: bpy.props.BoolProperty(options={"HIDDEN"})
    made: bpy.props.PointerProperty(type=bpy.types.Action, options={"HIDDEN"})
    action: bpy.props.PointerProperty(type=bpy.types.Action, options={"HIDDEN"})
    scene: bpy.props.PointerProperty(type=bpy.types.Scene, options={"HIDDEN"})
    # JSON, see _state().
    state: bpy.props.StringProperty(options={"HIDDEN"})


def is_on(armature: bpy.types.Object) -> bool:
    # Reading an unset group would leave it in the file.
    return armature.is_property_set("sinew_motion_range") and armature.sinew_motion_range.is_on


def armatures_on() -> list[bpy.types.Object]:
    """All of the file itself that play one."""
    return [obj for obj in bpy.data.objects if obj.type == "ARMATURE" and obj.is_editable and is_on(obj)]


def poses_on(armature: bpy.types.Object) -> list[tuple[str, int]]:
    """The names of the poses that an armature plays, with their frames."""
    made = armature.sinew_motion_range.made if is_on(armature) else None
    return [(marker.name, marker.frame) for marker in made.pose_markers] if made is not None else []


def check(armature: bpy.types.Object) -> None:
    """Raises SinewError where it can not play one."""
    if not armature.is_editable:
        raise SinewError(
            f"{armature.name} is linked: make a library override first (Object > Library Override)"
        )
    if armature.animation_data is not None and armature.animation_data.use_tweak_mode:
        raise SinewError(f"{armature.name} is tweaking an NLA strip: leave tweak mode first (Tab)")
    if armature.data.is_editmode:
        raise SinewError(f"{armature.name} is in edit mode; leave it first")


def start(
    scene: bpy.types.Scene, armature: bpy.types.Object, meshes: Sequence[bpy.types.Object]
) -> list[tuple[str, int]]:
    """Has an armature play its range of motion from frame FIRST on. Returns the poses, with their frames.

    meshes  that it deforms

    Raises SinewError where none of its bones bends anything.
    """
    check(armature)
    bones, moving = _bones(armature, meshes)
    poses = motion_range.poses(bones, armature_io.read_limits(armature), moving)
    if not poses:
        raise SinewError(f"{armature.name}: none of its bones bends anything")
    channels = _channels(armature, bones, poses)
    _hold(scene, armature)
    pose_io.write_channels(armature.pose.bones, channels[0].astype(np.float32))
    made = armature.sinew_motion_range.made = bpy.data.actions.new(f"{armature.name} {NAME}")
    named = _key(armature, made, channels, [pose.name for pose in poses])
    scene.use_preview_range = True
    scene.frame_preview_start, scene.frame_preview_end = FIRST, FIRST + 2 * STEP * len(poses)
    return named


def show(scene: bpy.types.Scene, armature: bpy.types.Object, bones: Bones, pose: battery.Pose) -> None:
    """Has an armature be in one pose: until restore(), or until the next frame where it plays one already.

    bones  of the armature

    Raises SinewError where it can not.
    """
    check(armature)
    channels = _channels(armature, bones, [pose])
    if not is_on(armature):
        _hold(scene, armature)
        armature.animation_data.action = None
    pose_io.write_channels(armature.pose.bones, channels[1].astype(np.float32))
    armature.update_tag()


def _hold(scene: bpy.types.Scene, armature: bpy.types.Object) -> None:
    """Leaves nothing that moves bones but an action, and keeps what restore() needs."""
    own = armature.animation_data.action if armature.animation_data is not None else None
    record, state = armature.sinew_motion_range, _state(scene, armature)
    record.is_on, record.action, record.scene, record.state = True, own, scene, json.dumps(state)
    _switch_off(armature)


def restore(armature: bpy.types.Object, keep: bool = False) -> None:
    """Puts back what start() or show() replaced.

    keep  its action stays in the file
    """
    record = armature.sinew_motion_range
    made, own, scene, state = record.made, record.action, record.scene, json.loads(record.state)
    armature.property_unset("sinew_motion_range")
    animation = armature.animation_data
    if animation is not None:
        actions.play_by_handle(animation, own, state["slot"] if own is not None else 0)
        for name, value in state["animation"].items():
            setattr(animation, name, value)
        for path, index in state["drivers"]:
            driver = animation.drivers.find(path, index=index)
            if driver is not None:
                driver.mute = False
        if not state["had_animation"]:
            armature.animation_data_clear()
    for name, constraint in state["constraints"]:
        bone = armature.pose.bones.get(name)
        if bone is not None and constraint in bone.constraints:
            bone.constraints[constraint].mute = False
    if scene is not None:
        (scene.use_preview_range, start, end), frame = state["preview"], state["frame"]
        scene.frame_preview_start, scene.frame_preview_end = start, end
        scene.frame_set(int(np.floor(frame)), subframe=frame - np.floor(frame))
    # After the frame: the pose may differ from its keys.
    channels = pose_io.read_channels(armature.pose.bones)
    for row, bone in enumerate(armature.pose.bones):
        channels[row] = state["channels"].get(bone.name, channels[row])
    pose_io.write_channels(armature.pose.bones, channels)
    if made is not None and keep:
        made.use_fake_user = True
    elif made is not None and not made.users:
        bpy.data.actions.remove(made)
    armature.update_tag()


def _bones(armature: bpy.types.Object, meshes: Sequence[bpy.types.Object]) -> tuple[Bones, np.ndarray]:
    """The bones, with the skin of the meshes; bool [bones], those that may move vertices."""
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bones, moving = armature_io.read_bones(evaluated), set()
    for obj in meshes:
        state = session.skinned_of(obj)
        if state is not None and properties.of(obj).armature == armature:
            deformer = state.bound.first_deformer
            moving.update(deformer.moving_bones)
            if deformer.bones.names == bones.names:
                bones = bones.with_skin_of(deformer.bones)
    return bones, np.array([name in moving or not moving for name in bones.names], bool) & bones.deform


def _channels(armature: bpy.types.Object, bones: Bones, poses: Sequence[battery.Pose]) -> np.ndarray:
    """float64 [1 + poses, bones, 10], at rest and in each pose, as pose_io.read_channels() has them."""
    modes = np.array([bone.rotation_mode for bone in armature.pose.bones])
    count = len(modes)
    at_rest = Poses(np.tile([1.0, 0, 0, 0, 0, 0, 0], (count, 1)), np.ones((count, 3)))
    # As Blender clears a pose; an axis has to be one.
    near = np.zeros((count, pose_io.CHANNELS))
    near[modes == "QUATERNION", 3] = 1.0
    near[modes == "AXIS_ANGLE", 5] = 1.0
    found = [pose_io.channels_of(at_rest, modes, near)]
    posed = [battery.posed(bones, pose) for pose in poses]
    rigid = np.zeros((len(poses), count, 7))
    for row, (pose_bone, above) in enumerate(zip(armature.pose.bones, bones.parents, strict=True)):
        own, parent = ([pose[bone] for pose in posed] for bone in (row, above))
        for number, basis in enumerate(spaces.channels_from_poses(pose_bone.bone, own, parent)):
            location, rotation, _scale = basis.decompose()
            rigid[number, row] = (*rotation, *location)
    found += [pose_io.channels_of(Poses(each, np.ones((count, 3))), modes, found[0]) for each in rigid]
    return np.array(found)


def _state(scene: bpy.types.Scene, armature: bpy.types.Object) -> dict:
    """What start() changes, for JSON."""
    animation = armature.animation_data
    bones = armature.pose.bones
    rows = pose_io.read_channels(bones).tolist()
    names = ("use_nla", "action_blend_type", "action_influence", "action_extrapolation")
    # Where several armatures play one, the first has changed the scene.
    others = [json.loads(each.sinew_motion_range.state) for each in armatures_on()]
    preview = [scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end]
    return {
        "had_animation": animation is not None,
        "slot": actions.handle_of(actions.slot_of(animation)) if animation is not None else 0,
        "animation": {name: getattr(animation, name) for name in names} if animation is not None else {},
        "drivers": [[curve.data_path, curve.array_index] for curve in _drivers(armature)],
        "constraints": [
            [bone.name, each.name] for bone in bones for each in bone.constraints if not each.mute
        ],
        "channels": {bone.name: row for bone, row in zip(bones, rows, strict=True)},
        "preview": others[0]["preview"] if others else preview,
        "frame": others[0]["frame"] if others else scene.frame_float,
    }


def _drivers(armature: bpy.types.Object) -> list[bpy.types.FCurve]:
    """Those that are on and move bones."""
    animation = armature.animation_data
    found = animation.drivers if animation is not None else ()
    return [curve for curve in found if not curve.mute and _MOVING.fullmatch(curve.data_path)]


def _switch_off(armature: bpy.types.Object) -> None:
    """Leaves nothing that moves bones but an action."""
    for curve in _drivers(armature):
        curve.mute = True
    for bone in armature.pose.bones:
        for constraint in bone.constraints:
            if not constraint.mute:
                constraint.mute = True
    animation = armature.animation_data or armature.animation_data_create()
    animation.use_nla = False
    animation.action_blend_type, animation.action_influence = "REPLACE", 1.0
    animation.action_extrapolation = "HOLD"


def _key(
    armature: bpy.types.Object, made: bpy.types.Action, channels: np.ndarray, names: Sequence[str]
) -> list[tuple[str, int]]:
    """Keys the poses with rest in between, and marks them by their names."""
    curves, slot = actions.new_curves(made, armature)
    times = FIRST + STEP * np.arange(2 * len(names) + 1)
    rows = np.zeros(len(times), int)
    rows[1::2] = np.arange(1, len(names) + 1)
    rotations = pose_io.rotation_properties(armature.pose.bones)
    for number, bone in enumerate(armature.pose.bones):
        of_rotation = rotations[bone.name]
        width = 3 if of_rotation == "rotation_euler" else 4
        for name, columns in (("location", range(3)), (of_rotation, range(3, 3 + width))):
            values = channels[:, number, columns]
            if np.abs(values - values[0]).max() < 1e-6:
                continue
            path = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].{name}'
            for index in range(len(columns)):
                curve = actions.new_curve(curves, path, index, bone.name)
                actions.write_keys(curve, times, values[rows, index])
    found = [(name, int(time)) for name, time in zip(names, times[1::2], strict=True)]
    for name, frame in found:
        made.pose_markers.new(name).frame = frame
    actions.play_by_handle(armature.animation_data, made, actions.handle_of(slot))
    return found
