# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file stores about live inverse kinematics: which constraints Sinew solves, and how."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ...attach import properties
from ...core import ik as core


class Listener:
    """The function that solves; set by ik_in_depsgraph, which this module does not import."""

    requested: Callable[[bpy.types.Object, str, str], None] | None = None


def _requested(follower: SinewIkFollower) -> float:
    if Listener.requested is not None:
        Listener.requested(follower.id_data, follower.root, follower.constraints)
    return 0.0


def _setting_changed(settings: SinewIkLive, _context: bpy.types.Context) -> None:
    # Blender evaluates nothing when a property without keys changes.
    settings.id_data.update_tag()


class SinewIkFollower(bpy.types.PropertyGroup):
    """Of a follower: the tree that is solved."""

    root: bpy.props.StringProperty(description="The tree's root bone", options={"HIDDEN"})
    constraints: bpy.props.StringProperty(description="What pulls the tree", options={"HIDDEN"})
    # Read by the last variable of its driver.
    request: bpy.props.FloatProperty(get=_requested, options={"HIDDEN"})


class SinewIkLive(bpy.types.PropertyGroup):
    """Of an armature object: how its live trees are solved."""

    method: bpy.props.EnumProperty(
        name="Method",
        description="How the rotations are found",
        items=[(name, label, text) for name, (label, text) in core.LABELS.items()],
        options=set(),
        update=_setting_changed,
        override=properties.OVERRIDABLE,
    )
    iterations: bpy.props.IntProperty(
        name="Iterations",
        description="The most steps or sweeps of a frame; a target in reach takes a few",
        default=core.ITERATIONS,
        min=1,
        soft_max=core.ITERATIONS,
        max=10000,
        options=set(),
        update=_setting_changed,
        override=properties.OVERRIDABLE,
    )


CLASSES = (SinewIkFollower, SinewIkLive)


def live_constraints(armature: bpy.types.Object) -> dict[str, str]:
    """Returns, by bone, the name of the IK constraint that Sinew has to solve live."""
    if not armature.sinew_ik_is_live or armature.pose is None:
        return {}
    return {bone.name: bone.sinew_ik_live for bone in armature.pose.bones if bone.sinew_ik_live}


def register() -> None:
    # Not in the groups below, which reading would add to each object. This flag saves reading all bones.
    bpy.types.Object.sinew_ik_is_live = bpy.props.BoolProperty(
        description="Whether Sinew solves chains of it live",
        options={"HIDDEN"},
        override=properties.OVERRIDABLE,
    )
    bpy.types.Object.sinew_ik_is_follower = bpy.props.BoolProperty(
        description="Whether Sinew made it for bones that follow", options={"HIDDEN"}
    )
    bpy.types.Object.sinew_ik_follower = bpy.props.PointerProperty(type=SinewIkFollower)
    bpy.types.Object.sinew_ik = bpy.props.PointerProperty(type=SinewIkLive, override=properties.OVERRIDABLE)
    # Stored with the bone, so that it survives renaming.
    bpy.types.PoseBone.sinew_ik_live = bpy.props.StringProperty(
        name="Live",
        description="The bone's IK constraint that Sinew solves live",
        options={"HIDDEN"},
        override=properties.OVERRIDABLE,
    )


def unregister() -> None:
    del bpy.types.PoseBone.sinew_ik_live
    del bpy.types.Object.sinew_ik
    del bpy.types.Object.sinew_ik_follower
    del bpy.types.Object.sinew_ik_is_follower
    del bpy.types.Object.sinew_ik_is_live
