# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks for what neither a bake nor live inverse kinematics can keep."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...core import ik as core
from ...core.errors import SinewError
from ...io import actions


def check_not_switched(armature: bpy.types.Object, trees: Sequence[core.Tree]) -> None:
    """Raises SinewError where keys or drivers switch a tree's constraints, which Sinew mutes."""
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
