# SPDX-License-Identifier: GPL-3.0-or-later
"""What plays an object's actions, and the F-curves of an action that move bones: finding them, and reading
their keys."""

import functools
import re
from collections.abc import Sequence
from typing import NamedTuple

import bpy
import numpy as np

from ..skinning.arrays import read

# The first column of each of a bone's channels, as in pose_io.read_channels().
COLUMNS = {
    "location": 0,
    "rotation_quaternion": 3,
    "rotation_axis_angle": 3,
    "rotation_euler": 3,
    "scale": 7,
}
_BONE_PATH = re.compile(rf'pose\.bones\["(.*)"\]\.({"|".join(COLUMNS)})')

REPEATING = {"REPEAT", "REPEAT_OFFSET"}


class Channel(NamedTuple):
    """What a curve moves: a property of a bone, and its column in the bone's row of channels."""

    bone: str
    property: str
    column: int


def slot_of(player: bpy.types.AnimData | bpy.types.NlaStrip) -> bpy.types.bpy_struct | None:
    """Returns the slot of its action that `player` plays; None up to Blender 4.3, which has no slots."""
    return getattr(player, "action_slot", None)


def handle_of(slot: bpy.types.bpy_struct | None) -> int:
    return slot.handle if slot is not None else 0


def playing(
    obj: bpy.types.Object,
) -> tuple[bpy.types.Action | None, bpy.types.bpy_struct | None]:
    """Returns the action that an object plays, and its slot."""
    animation = obj.animation_data
    if animation is None or animation.action is None:
        return None, None
    return animation.action, slot_of(animation)


def curve_lists(
    action: bpy.types.Action, slot: bpy.types.bpy_struct | None
) -> list[bpy.types.bpy_prop_collection]:
    """Returns the F-curves for `slot`: the action's own up to 4.3, those of its slot since 4.4."""
    if not hasattr(action, "layers"):
        return [action.fcurves]
    if slot is None:
        return []
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips]
    return [bag.fcurves for bag in bags if bag is not None]


def slot_for(action: bpy.types.Action, obj: bpy.types.Object) -> bpy.types.bpy_struct | None:
    """Returns the slot by which `obj` plays an action, or would: of the slots for objects the one with its
    name, else the one that moves most of its bones; None up to Blender 4.3."""
    if not hasattr(action, "slots"):
        return None
    animation = obj.animation_data
    if animation is not None and animation.action == action and animation.action_slot is not None:
        return animation.action_slot
    usable = [slot for slot in action.slots if slot.target_id_type in ("OBJECT", "UNSPECIFIED")]
    names = set(obj.pose.bones.keys()) if obj.pose is not None else set()

    def fitness(slot: bpy.types.bpy_struct) -> tuple[bool, int]:
        bones = names & bone_curves(action, slot).keys()
        return bool(bones) and slot.name_display == obj.name, len(bones)

    return max(usable, key=fitness, default=None)


def new_curves(
    action: bpy.types.Action, obj: bpy.types.Object
) -> tuple[bpy.types.bpy_prop_collection, bpy.types.bpy_struct | None]:
    """Returns where F-curves for `obj` go in a new action, and the slot that plays them; None up to Blender
    4.3."""
    if not hasattr(action, "layers"):
        return action.fcurves, None
    slot = action.slots.new("OBJECT", obj.name)
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True).fcurves, slot


def new_curve(curves: bpy.types.bpy_prop_collection, path: str, index: int, group: str) -> bpy.types.FCurve:
    """Makes an F-curve in a group of the Graph Editor; in slots, Blender 4.4 and 4.5 cannot make groups."""
    known = curves.bl_rna.functions["new"].parameters
    name = next((each for each in ("group_name", "action_group") if each in known), None)
    return curves.new(path, index=index, **({name: group} if name is not None else {}))


def play(obj: bpy.types.Object, action: bpy.types.Action) -> None:
    """Has `obj` play the action, by the slot of slot_for(); the previous action stays in the file."""
    slot = slot_for(action, obj)
    animation = obj.animation_data or obj.animation_data_create()
    before = animation.action
    if before is not None and before != action and before.is_editable:
        before.use_fake_user = True
    animation.action = action
    if slot is not None:
        animation.action_slot = slot


def play_by_handle(player: bpy.types.AnimData | bpy.types.NlaStrip, action: object, handle: int) -> None:
    """Has `player` play an action, or none, by its slot with this handle: that of a copy is that of its
    original."""
    player.action = action
    slot = next((each for each in getattr(action, "slots", ()) if each.handle == handle), None)
    if slot is not None:
        player.action_slot = slot


def all_curves(action: bpy.types.Action | None, slot: bpy.types.bpy_struct | None) -> list[bpy.types.FCurve]:
    return [curve for curves in curve_lists(action, slot) for curve in curves] if action is not None else []


def channel_of(curve: bpy.types.FCurve) -> Channel | None:
    """Returns which channel of a bone's transform the curve moves; None where it moves something else."""
    found = _bone_property(curve.data_path)
    return Channel(*found, COLUMNS[found[1]] + curve.array_index) if found else None


@functools.lru_cache(maxsize=100_000)
def _bone_property(path: str) -> tuple[str, str] | None:
    match = _BONE_PATH.fullmatch(path)
    return (bpy.utils.unescape_identifier(match[1]), match[2]) if match else None


def bone_curves(
    action: bpy.types.Action | None, slot: bpy.types.bpy_struct | None, muted: bool = True
) -> dict[str, list[tuple[bpy.types.FCurve, Channel]]]:
    """Returns the curves that move bones, by bone.

    muted  also those that are
    """
    bones: dict[str, list[tuple[bpy.types.FCurve, Channel]]] = {}
    for curve in all_curves(action, slot):
        channel = channel_of(curve)
        if channel is not None and (muted or not curve.mute):
            bones.setdefault(channel.bone, []).append((curve, channel))
    return bones


def key_times(curves: Sequence[bpy.types.FCurve]) -> np.ndarray:
    """Returns the times at which any of the curves has a key, ascending, float32."""
    times = [read(curve.keyframe_points, "co", 2)[:, 0] for curve in curves]
    # Keyed poses have keys in all channels, so there is seldom anything to sort.
    if len({array.tobytes() for array in times}) == 1:
        return times[0]
    return np.unique(np.concatenate(times))


def gains_of_a_round(
    curves: Sequence[bpy.types.FCurve], times: np.ndarray, onwards: bool
) -> np.ndarray | None:
    """Returns how much each of a bone's curves increases, [curves], from one cycle of its keys at `times` to
    the next, where they repeat after the last key (`onwards`) or before the first; None where they do not
    repeat, or with different periods."""
    gains = []
    for curve in curves:
        modifiers = [m for m in curve.modifiers if not m.mute]
        if len(modifiers) != 1 or modifiers[0].type != "CYCLES" or len(curve.keyframe_points) < 2:
            return None
        modifier = modifiers[0]
        mode, count = (
            (modifier.mode_after, modifier.cycles_after)
            if onwards
            else (modifier.mode_before, modifier.cycles_before)
        )
        first, last = curve.keyframe_points[0].co, curve.keyframe_points[-1].co
        limited = count or modifier.use_restricted_range or modifier.use_influence
        if mode not in REPEATING or limited or first[0] != times[0] or last[0] != times[-1]:
            return None
        gains.append(last[1] - first[1] if mode == "REPEAT_OFFSET" else 0.0)
    return np.array(gains)


def hold_still(curves: Sequence[bpy.types.FCurve], times: np.ndarray) -> np.ndarray:
    """Returns at which of `times` all curves hold the value of a key until the next (interpolation
    Constant)."""
    still = np.ones(len(times), dtype=bool)
    for curve in curves:
        points = curve.keyframe_points
        kinds = read(points, "interpolation", kind=np.int32)
        key = np.searchsorted(read(points, "co", 2)[:, 0], times, side="right") - 1
        still &= (key >= 0) & (kinds[key] == key_value("interpolation", "CONSTANT"))
        if not still.any():
            break
    return still


@functools.cache
def key_value(name: str, choice: str) -> int:
    """Returns the number that stands for a choice of a key's property in Blender's arrays."""
    return bpy.types.Keyframe.bl_rna.properties[name].enum_items[choice].value


def write_keys(curve: bpy.types.FCurve, times: Sequence[float], values: np.ndarray) -> None:
    """Replaces all keys from the first to the last of `times` by keys at `times`, with linear interpolation;
    those outside stay."""
    points = curve.keyframe_points
    for point in reversed([point for point in points if times[0] <= point.co.x <= times[-1]]):
        points.remove(point, fast=True)
    kept = len(points)
    points.add(len(times))
    kinds, keys = read(points, "interpolation", kind=np.int32), read(points, "co", 2)
    kinds[kept:] = key_value("interpolation", "LINEAR")
    keys[kept:] = np.column_stack([times, values])
    points.foreach_set("interpolation", kinds)
    points.foreach_set("co", keys.ravel())
    curve.update()


def reason_against(curves: Sequence[bpy.types.FCurve]) -> str | None:
    """Returns why a bone's curves cannot be keyed poses; None where they can."""
    if not all(len(curve.keyframe_points) for curve in curves):
        return "has a curve without keys"
    for curve in curves:
        others = {m.type for m in curve.modifiers if not m.mute} - {"CYCLES"}
        if others:
            return f"has an F-curve modifier ({', '.join(sorted(others)).lower()})"
    return None


def plays(channel: Channel, rotation: str | None) -> bool:
    """Whether the channel has an effect where `rotation` is its bone's rotation property: not a rotation of
    another mode, nor a channel of a missing bone."""
    return rotation is not None and channel.property in ("location", "scale", rotation)


def animated_paths(obj: bpy.types.Object) -> set[str]:
    """Returns the data paths that the object's actions and drivers set."""
    return {curve.data_path for curve in curves_of(obj)}


def curves_of(owner: bpy.types.Object | bpy.types.Mesh | bpy.types.Key) -> list[bpy.types.FCurve]:
    """Returns the curves of its actions, also in strips, and of its drivers."""
    animation = owner.animation_data
    if animation is None:
        return []
    played = [all_curves(p.action, slot_of(p)) for p in players(animation)]
    return [*animation.drivers, *(curve for each in played for curve in each)]


def players(animation: bpy.types.AnimData) -> list[bpy.types.AnimData | bpy.types.NlaStrip]:
    """Returns everything that plays an action, or could."""
    return [animation, *(strip for track in animation.nla_tracks for strip in track.strips)]


def is_animated(obj: bpy.types.Object, modifier: bpy.types.Modifier, name: str) -> bool:
    """Whether keys or drivers set a modifier's property."""
    return f'modifiers["{bpy.utils.escape_identifier(modifier.name)}"].{name}' in animated_paths(obj)
