# SPDX-License-Identifier: GPL-3.0-or-later
"""A range of motion: stated poses of a rig, in the order in which a rigger looks at its joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...skinning.rig import Bones
from .battery import Battery, Limits, Move, Pose, sides

RANGE: Mapping[str, tuple[Move, ...]] = {
    "Elbows bent": (Move("forearm", "bend", 130.0),),
    "Wrists twisted": (Move("hand", "twist", 150.0),),
    "Wrists twisted back": (Move("hand", "twist", -150.0),),
    "Wrists bent": (Move("hand", "bend", 70.0, "in"),),
    "Arms raised": (Move("upper_arm", "aim", 150.0, "out"),),
    "Arms across": (Move("upper_arm", "aim", 90.0, "across"),),
    "Squat": (
        Move("thigh", "aim", 100.0, "front"),
        Move("shin", "bend", 120.0, "back"),
        Move("foot", "bend", 25.0, "up"),
    ),
    "Legs back": (Move("thigh", "aim", 30.0, "back"),),
    "Legs apart": (Move("thigh", "aim", 60.0, "out"),),
    "Knees bent": (Move("shin", "bend", 130.0, "back"),),
    "Feet bent": (Move("foot", "bend", 25.0, "up"),),
    "Feet stretched": (Move("foot", "open", 45.0, "up"),),
    "Neck turned": (Move("neck", "turn", 70.0, shared=True),),
    "Neck bowed": (Move("neck", "bend", 50.0, shared=True),),
    "Back bent": (Move("spine", "bend", 60.0, shared=True),),
    "Back turned": (Move("spine", "turn", 60.0, shared=True),),
    "Fists": (Move("finger", "bend", 75.0, "in"), Move("thumb", "bend", 35.0)),
}
"""Of a figure that stands upright; angles in degrees."""

# Their poses, each with the joint that is looked at.
COLUMNS = {
    "Elbows bent": "Elbow",
    "Wrists twisted": "Wrist",
    "Arms raised": "Shoulder",
    "Squat": "Hip",
    "Knees bent": "Knee",
    "Neck turned": "Neck",
    "Fists": "Fingers",
    "Back bent": "Spine",
}
# What else is done, so that the joint is seen.
_ARMS_UP = (Move("upper_arm", "aim", 160.0, "out"),)
ASIDE = {"Back bent": _ARMS_UP, "Squat": _ARMS_UP}
# Columns of a rig that is no figure.
MOST_OTHERS = 6
SWING = 60.0


class Column(NamedTuple):
    """A joint in a pose, on one side.

    joint  for people, as "Elbow"; the bone's name in a rig that is no figure
    bones  that are looked at
    """

    joint: str
    pose: Pose
    bones: tuple[int, ...]


def poses(bones: Bones, limits: Limits, moving: np.ndarray) -> list[Pose]:
    """Returns the poses of a rig. A figure takes the stated angles, whatever limits its bones have; other
    rigs what the battery has for them.

    moving  bool [bones], those that move vertices
    """
    figure = Battery(bones, {}, moving)
    return figure.poses(RANGE) if figure.is_figure else Battery(bones, limits, moving).poses()


def columns(bones: Bones, moving: np.ndarray) -> list[Column]:
    """Returns the joints of a figure, each bent on its left side, or on its right where there is no left. Of
    other rigs each joint is a column, bent about its first axis; of mirrored ones the left."""
    battery, (side, mirror) = Battery(bones, {}, moving), sides(bones.names)
    if not battery.is_figure:
        swing = {role: (Move(role, "swing", SWING),) for role in ("other",)}
        found: dict[int, Column] = {}
        for bone, pose in battery.of_joints(swing):
            if side[bone] >= 0 or mirror[bone] < 0:
                found.setdefault(bone, Column(bones.names[bone], pose, (bone,)))
        return list(found.values())
    roles, taken = battery.roles(), []
    for pose in battery.poses(RANGE):
        joint = COLUMNS.get(pose.name)
        if joint is None:
            continue
        kept = next(
            own
            for sign in (1, -1)
            if (own := {b: r for b, r in pose.rotations.items() if side[b] in (0, sign)}) or sign < 0
        )
        looked_at = RANGE[pose.name][0].role
        aside = battery.poses({pose.name: ASIDE.get(pose.name, ())})
        kept |= aside[0].rotations if aside else {}
        own_bones = tuple(bone for bone in kept if roles[bone] == looked_at)
        if own_bones:
            taken.append(Column(joint, Pose(pose.name, kept), own_bones))
    return taken
