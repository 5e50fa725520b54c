# SPDX-License-Identifier: GPL-3.0-or-later
"""Inverse kinematics: rotations of bones, within limits, that bring tips to their goals.

Poses are dual quaternions internally, and each axis that a bone may rotate about is a screw. One problem or
many are solved: the axes before the last ones of each argument broadcast as in numpy, for example for the
frames of an animation. Each problem starts from its own `rotations` and does not depend on the others. All
results are float64. Arrays may be anything that numpy converts to one. ValueError names the argument, what
was expected and what was given.
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


class Solution(NamedTuple):
    """rotations [.., bones, 4]: relative to rest, w >= 0; distance and angle (radians) [..]: the largest
    remaining errors of a tip's position and rotation; iterations [..], int32; is_reached [..]: whether
    both are within the tolerance."""

    rotations: NDArray[np.float64]
    distance: NDArray[np.float64] | Any
    angle: NDArray[np.float64] | Any
    iterations: NDArray[np.int32] | Any
    is_reached: NDArray[np.bool_] | Any


class Solver:
    """A solver for one tree of bones with its limits and effectors. solve() allocates only its result."""

    def __init__(
        self,
        parents: ArrayLike,
        effectors: Sequence[Effector],
        *,
        locked: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
    ) -> None:
        """parents: int32 [bones], the index of each bone's parent, -1 for a root; parents precede their
            children.
        effectors: at least one.
        locked: bool [bones, 3], axes x, y (along the bone) and z about which a bone does not rotate.
        limits: [bones, 3, 2], the smallest and the largest angle about x, y and z, radians, with -pi <=
            smallest <= 0 <= largest <= pi; (-inf, inf) for no limit. The angles are those of
            swing_twist_angles(), as for Blender's IK limits. With limits of x and z a bone's swing stays
            within an ellipse through the four. Bones with limits or locks swing by at most 177.7 degrees.
        stiffness: [bones, 3], 0 to below 1: how much less the bone rotates about an axis than about others.
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
        """Finds rotations that bring the tips to the goals.

        rest: [.., bones, 4, 4], [.., bones, 3, 4], [.., bones, 7] or [.., bones, 8]: each bone relative to
            its parent, not rotated. A matrix's linear part is replaced by the nearest rotation.
        tips: [.., effectors, 3], each in the space of its bone.
        goals: [.., effectors, ..], in any of these layouts: the goals of each tip's position and of its
            bone's rotation.
        poles: [.., effectors, 3], points; None if no effector has a pole.
        rotations: [.., bones, 4], the start; rotations beyond the limits are brought within. None: no
            rotation.
        root: [.., 4, 4], [.., 3, 4], [.., 7] or [.., 8], applied after the transform of every bone without a
            parent; None: the identity. Goals and poles are in the space that it maps to.
        method: one of METHODS.

            dls  damped least squares on screws; each step moves all axes (Wampler 1986; Sugihara 2011)
            ccd  cyclic descent, one bone after the other from the tip (Wang, Chen 1991): cheap steps, but
                 many of them where a chain is nearly straight or limited

        tolerance: errors that count as reached, in lengths of the longest chain and in radians.
        iterations: maximum number of steps of all axes, or of sweeps over all bones.

        If a chain with one effector whose rotation does not count can not reach its goal, the goal is moved
        to the nearest point of its range; a chain without limits stretches straight towards it. A straight
        chain that points at a nearer goal is bent a little about its first free axis. A pole on the line
        from root to goal is ignored. Limits can cause local minima: the result is within limits, and no step
        improves it. A chain with one effector is solved a second time, starting with a rotation to the goal,
        and the better result is used.
        """
        return Solution(
            *self._solver.solve(rest, tips, goals, poles, rotations, root, method, tolerance, iterations)
        )


def swing_twist_angles(rotations: NDArray[Float] | ArrayLike) -> NDArray[Any]:
    """The angles that limits bound, [.., 3], radians. A rotation is decomposed into a twist about y, by the
    angle y, followed by a swing without twist; x and z are twice the arcsines of the x and z of its
    quaternion, so that for a swing about x alone x is its angle.

    rotations: [.., 4]; signs and lengths do not matter. For a swing by 180 degrees the twist is 0.
    """
    angles: NDArray[Any] = _native.swing_twist_angles(rotations)
    return angles
