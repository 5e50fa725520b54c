# SPDX-License-Identifier: GPL-3.0-or-later
"""A range of motion: stated poses of a rig, in the order in which a rigger looks at its joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...skinning.rig import Bones
from .battery import FIGURE, Battery, Limits, Move, Pose, sides

RANGE: Mapping[str, tuple[Move, ...]] = {
    "Elbows bent": FIGURE["Elbows bent"],
    "Wrists twisted": FIGURE["Wrists twisted"],
    "Wrists twisted back": (Move("hand", "twist", -150.0),),
    "Wrists bent": FIGURE["Wrists bent"],
    "Arms raised": FIGURE["Arms raised"],
    "Arms across": (Move("upper_arm", "aim", 90.0, "across"),),
    "Squat": FIGURE["Squat"],
    "Legs back": (Move("thigh", "aim", 30.0, "back"),),
    "Legs apart": FIGURE["Legs apart"],
    "Knees bent": (Move("shin", "bend", 130.0, "back"),),
    "Feet bent": (Move("foot", "bend", 25.0, "up"),),
    "Feet stretched": (Move("foot", "open", 45.0, "up"),),
    "Neck turned": (Move("neck", "turn", 70.0, shared=True),),
    "Neck bowed": (Move("neck", "bend", 50.0, shared=True),),
    "Back bent": FIGURE["Back bent"],
    "Back turned": FIGURE["Back turned"],
    "Fists": FIGURE["Fists"],
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
    "Back bent": "Spine",
    "Fists": "Fingers",
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
        found: dict[int, Column] = {}
        for bone, pose in battery.of_joints({"other": (Move("other", "swing", SWING),)}):
            if side[bone] >= 0 or mirror[bone] < 0:
                found.setdefault(bone, Column(bones.names[bone], pose, (bone,)))
        return list(found.values())
    roles, taken = battery.roles(), []
    for name, joint in COLUMNS.items():
        rotations = _of_one_side(battery.pose_of(name, RANGE[name]).rotations, side)
        own = tuple(bone for bone in rotations if roles[bone] == RANGE[name][0].role)
        if own:
            aside = battery.pose_of(name, ASIDE.get(name, ())).rotations
            taken.append(Column(joint, Pose(name, rotations | aside), own))
    return taken


def _of_one_side(rotations: Mapping[int, np.ndarray], side: np.ndarray) -> dict[int, np.ndarray]:
    """Returns those of the left side, or of the right where there is no left; and of neither."""
    of_sides = ({b: r for b, r in rotations.items() if side[b] in (0, sign)} for sign in (1, -1))
    return next(filter(None, of_sides), {})
