# SPDX-License-Identifier: GPL-3.0-or-later
"""Inverse kinematics: rotations of bones, within limits, that bring tips to their goals.

Poses are dual quaternions internally, and each axis that a bone may rotate about is a screw. One problem or
many are solved: the axes before the last ones of each argument broadcast as in numpy, for example for the
frames of an animation. Each problem starts from its own `rotations` and does not depend on the others. A
solver's results are float64.
"""

from typing import NamedTuple

from future_work_native.ik import Solver, swing_twist_angles

from .types import Solution

__all__ = ["Effector", "Solution", "Solver", "swing_twist_angles"]


class Effector(NamedTuple):
    """The goal for the tip of one bone.

    bone: its index. The bone and all of its ancestors rotate.
    position_weight, rotation_weight: 0 means that the position or rotation does not count. An error of 1
        radian counts like one of the chain's length.
    has_pole: first rotate the chain about its root, as Blender's constraint does, so that its tip points at
        the goal and the axis cos(pole_angle) x + sin(pole_angle) z of the root bone points to the side of
        the pole. Bends then stay in that plane. With several effectors, poles are ignored.
    """

    bone: int
    position_weight: float = 1.0
    rotation_weight: float = 0.0
    has_pole: bool = False
    pole_angle: float = 0.0
