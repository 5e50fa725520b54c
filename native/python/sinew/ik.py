# SPDX-License-Identifier: GPL-3.0-or-later
"""Inverse kinematics: rotations of bones, within limits, that bring tips to where they are wanted.

Poses are dual quaternions inside, and each axis that a bone may rotate about is a screw. One problem is
solved or many: axes before the last ones of each argument broadcast as numpy's do, frames of an animation,
say. Every problem starts from its own `rotations` and depends on no other. All is float64, whatever comes.
Arrays are anything that numpy makes one of. ValueError names the argument, what was wanted and what came.
"""

from collections.abc import Sequence
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._native import ik as _native
from ._types import Float

__all__ = ["METHODS", "Effector", "Method", "Solution", "Solver", "swing_twist_angles"]

Method = Literal["dls", "ccd"]

METHODS: Final[tuple[Method, ...]] = _native.METHODS


class Effector(NamedTuple):
    """What is to be where: the tip of a bone.

    bone: its index. It and all bones above it rotate.
    position_weight, rotation_weight: 0: the one or the other does not count. An error of 1 radian counts as
        one of the chain's length.
    has_pole: first rotate the chain about its root, as Blender's constraint does, until its tip lies to its
        goal and the axis cos(pole_angle) x + sin(pole_angle) z of the root bone to the side of the pole: what
        then bends stays in that plane. With several effectors no pole counts.
    """

    bone: int
    position_weight: float = 1.0
    rotation_weight: float = 0.0
    has_pole: bool = False
    pole_angle: float = 0.0


class Solution(NamedTuple):
    """rotations [.., bones, 4]: relative to rest, w >= 0; distance and angle (radians) [..]: the largest that
    is left of a tip's position and rotation; iterations [..], int32; is_reached [..]: whether both are within
    the tolerance."""

    rotations: NDArray[np.float64]
    distance: NDArray[np.float64] | Any
    angle: NDArray[np.float64] | Any
    iterations: NDArray[np.int32] | Any
    is_reached: NDArray[np.bool_] | Any


class Solver:
    """Of one tree of bones, its limits and effectors; solve() allocates nothing but its result."""

    def __init__(
        self,
        parents: ArrayLike,
        effectors: Sequence[Effector],
        *,
        locked: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
    ) -> None:
        """parents: int32 [bones], the index of each bone's parent, -1 for a root; parents come first.
        effectors: at least one.
        locked: bool [bones, 3], axes x, y (along the bone) and z that a bone does not rotate about.
        limits: [bones, 3, 2], the least and the largest angle about x, y and z, radians, -pi <= least <= 0 <=
            largest <= pi; (-inf, inf) where there is none. The angles are those of swing_twist_angles(), as
            of Blender's IK limits. With limits of x and z a bone's swing stays within an ellipse through the
            four. Of bones with limits or locks it ends at 177.7 degrees.
        stiffness: [bones, 3], 0 to below 1: how much less than others the bone rotates about an axis.
        """
        self._solver = _native.Solver(
            parents,
            np.array([effector.bone for effector in effectors], np.int32),
            np.array([(e.position_weight, e.rotation_weight) for e in effectors], float).reshape(-1, 2),
            np.array([(e.has_pole, e.pole_angle) for e in effectors], float).reshape(-1, 2),
            locked,
            limits,
            stiffness,
        )

    def solve(
        self,
        rest: ArrayLike,
        tips: ArrayLike,
        goals: ArrayLike,
        poles: ArrayLike | None = None,
        *,
        rotations: ArrayLike | None = None,
        root: ArrayLike | None = None,
        method: Method = "dls",
        tolerance: float = 1e-6,
        iterations: int = 100,
    ) -> Solution:
        """Rotations that bring the tips to the goals.

        rest: [.., bones, 4, 4], [.., bones, 3, 4], [.., bones, 7] or [.., bones, 8]: each bone relative to
            its parent where it does not rotate. A matrix's linear part becomes the nearest rotation.
        tips: [.., effectors, 3], each in the space of its bone.
        goals: [.., effectors, ..], in any of these layouts: where each tip is to be, and how its bone is to
            be rotated.
        poles: [.., effectors, 3], points; None where no effector has a pole.
        rotations: [.., bones, 4], where to start; what is beyond limits is brought within. None: no rotation.
        root: [.., 4, 4], [.., 3, 4], [.., 7] or [.., 8], before bones without a parent; None: nothing. Goals
            and poles are in the space that it leads to.
        method: one of METHODS.

            dls  damped least squares on screws; a step for all axes (Wampler 1986; Sugihara 2011)
            ccd  cyclic descent, one bone after the other from the tip (Wang, Chen 1991): cheap steps, and
                 many of them where a chain is nearly straight, or limited

        tolerance: in lengths of the longest chain, and in radians: what counts as reached.
        iterations: at most; steps of all axes, or sweeps over all bones.

        A goal out of reach of a chain of one effector whose rotation does not count is moved to the nearest
        end of the reach: a chain without limits stretches straight to it. A chain that is straight to a
        nearer goal is bent a little about its first free axis. A pole on the line from root to goal does not
        count; limits are kept where a pole wants otherwise. With limits the result can be a local minimum:
        within them, and such that no step improves it; a chain of one effector is tried once more from its
        start rotated to the goal, and the better result stays.
        """
        return Solution(
            *self._solver.solve(rest, tips, goals, poles, rotations, root, method, tolerance, iterations)
        )


def swing_twist_angles(rotations: NDArray[Float] | ArrayLike) -> NDArray[Any]:
    """[.., 3], radians: what limits bound. A rotation is a twist about y, of the angle y, and then a swing
    without twist: x and z are twice the arcsines of its quaternion's x and z, so that of a swing about x
    alone x is its angle.

    rotations: [.., 4]; signs and lengths do not matter. Of a swing by 180 degrees the twist is 0.
    """
    angles: NDArray[Any] = _native.swing_twist_angles(rotations)
    return angles
