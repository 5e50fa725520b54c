# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones of a figure as rigs of many kinds name them."""

from dataclasses import replace

import numpy as np
from sinew_addon.skinning.rig import Bones

# Parent, head and tail of a figure that faces -Y, its left at +X.
TRUNK = {
    "hips": ("", (0, 0, 1.0), (0, 0, 1.1)),
    "spine": ("hips", (0, 0, 1.1), (0, 0, 1.3)),
    "chest": ("spine", (0, 0, 1.3), (0, 0, 1.5)),
    "neck": ("chest", (0, 0, 1.5), (0, 0, 1.6)),
    "head": ("neck", (0, 0, 1.6), (0, 0, 1.8)),
}
LIMBS = {
    "upper_arm": ("chest", (0.2, 0, 1.45), (0.5, 0, 1.45)),
    "forearm": ("upper_arm", (0.5, 0, 1.45), (0.8, 0, 1.45)),
    "hand": ("forearm", (0.8, 0, 1.45), (0.9, 0, 1.45)),
    "index": ("hand", (0.9, 0, 1.45), (0.95, 0, 1.45)),
    "thigh": ("hips", (0.1, 0, 1.0), (0.1, 0, 0.5)),
    "shin": ("thigh", (0.1, 0, 0.5), (0.1, 0, 0.1)),
    "foot": ("shin", (0.1, 0, 0.1), (0.1, -0.15, 0.0)),
}
NAMES = {
    "rigify": "DEF-{name}{.S}",
    "unreal": "{name}{_s}",
    "mixamo": "mixamorig:{Side}{Name}",
    "vrm": "J_Bip_{X}_{Name}",
    "makehuman": "{name}{.S}",
    "auto_rig": "{name}{.x}",
}
# What rigs call the bones; others have their plain names.
OTHERS = {
    "rigify": {
        **{"hips": "spine", "spine": "spine.001", "chest": "spine.003", "neck": "spine.004"},
        **{"head": "spine.006", "index": "f_index.01"},
    },
    "unreal": {
        **{"hips": "pelvis", "spine": "spine_01", "chest": "spine_02", "upper_arm": "upperarm"},
        **{"forearm": "lowerarm", "shin": "calf", "index": "index_01"},
    },
    "mixamo": {
        **{"chest": "spine1", "upper_arm": "arm", "forearm": "ForeArm", "thigh": "UpLeg"},
        **{"shin": "leg", "index": "HandIndex1"},
    },
    "vrm": {
        **{"upper_arm": "UpperArm", "forearm": "LowerArm", "thigh": "UpperLeg", "shin": "LowerLeg"},
        **{"index": "Index1"},
    },
    "makehuman": {
        **{"hips": "root", "spine": "spine05", "chest": "spine01", "neck": "neck01"},
        **{"upper_arm": "upperarm01", "forearm": "lowerarm01", "hand": "wrist", "thigh": "upperleg01"},
        **{"shin": "lowerleg01", "index": "finger2-1"},
    },
    "auto_rig": {
        **{"hips": "root", "spine": "spine_01", "chest": "spine_02", "upper_arm": "arm_stretch"},
        **{"forearm": "forearm_stretch", "thigh": "thigh_stretch", "shin": "leg_stretch", "index": "index1"},
    },
}


def named(naming, name, side):
    """side: L, R or empty"""
    name = OTHERS[naming].get(name, name)
    words = {"L": "Left", "R": "Right", "": ""}
    values = {
        **{"{name}": name, "{Name}": name[0].upper() + name[1:], "{Side}": words[side], "{X}": side or "C"},
        **{"{.S}": f".{side}" if side else "", "{_s}": f"_{side.lower()}" if side else ""},
        "{.x}": f".{side.lower() or 'x'}",
    }
    made = NAMES[naming]
    for place, value in values.items():
        made = made.replace(place, value)
    return made


def rig(bones):
    """bones: parent, head and tail by name."""
    names, count = tuple(bones), len(bones)
    rest = np.tile(np.identity(4, np.float32), (count, 1, 1))
    lengths = np.zeros(count, np.float32)
    for number, (_parent, head, tail) in enumerate(bones.values()):
        along = np.subtract(tail, head)
        lengths[number] = np.linalg.norm(along)
        y = along / lengths[number]
        x = np.cross(y, (0.3, 0.5, 0.8))
        x /= np.linalg.norm(x)
        rest[number, :3, :3] = np.stack([x, y, np.cross(x, y)], axis=1)
        rest[number, :3, 3] = head
    parents = np.array([names.index(parent) if parent else -1 for parent, *_rest in bones.values()], np.int32)
    made = replace(Bones.none(), names=names, deform=np.ones(count, bool), rest=rest, lengths=lengths)
    first = np.full(count, -1, np.int32)
    return replace(made, segments=np.ones(count, np.int32), first_joints=first, parents=parents)


def figure(naming="rigify", limbs=LIMBS, trunk=TRUNK):
    """Returns the bones, and the number of each by its plain name and side."""
    made, plain = {}, {}
    for side, sign in (("", 1), ("L", 1), ("R", -1)):
        for name, (parent, head, tail) in (limbs if side else trunk).items():
            own = named(naming, name, side)
            mirrored = [tuple(np.multiply(point, (sign, 1, 1))) for point in (head, tail)]
            above = named(naming, parent, side if parent in LIMBS else "") if parent else ""
            plain[name, side] = len(made)
            made[own] = (above, *mirrored)
    return rig(made), plain
