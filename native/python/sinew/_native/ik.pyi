from __future__ import annotations
import collections.abc
import numpy.typing
import sinew._types
import sinew.ik
import typing
__all__: list[str] = ['Solver', 'swing_twist_angles']
class Solver:
    """A solver for one tree of bones with its limits and effectors. solve() allocates only its result."""
    def __init__(self, parents: numpy.typing.ArrayLike, effectors: collections.abc.Sequence[sinew.ik.Effector], *, locked: numpy.typing.ArrayLike | None = None, limits: numpy.typing.ArrayLike | None = None, stiffness: numpy.typing.ArrayLike | None = None) -> None:
        """parents: int32 [bones], the index of each bone's parent, -1 for a root; parents precede their
            children.
        effectors: at least one.
        locked: bool [bones, 3], axes x, y (along the bone) and z about which a bone does not rotate.
        limits: [bones, 3, 2], the smallest and the largest angle about x, y and z, radians, with -pi <= smallest <= 0
            <= largest <= pi; (-inf, inf) for no limit. The angles are those of swing_twist_angles(), as for Blender's
            IK limits. With limits of x and z a bone's swing stays within an ellipse through the four. Bones with
            limits or locks swing by at most 177.7 degrees.
        stiffness: [bones, 3], 0 to below 1: how much less the bone rotates about an axis than about others.
        """
    def solve(self, rest: numpy.typing.ArrayLike, tips: numpy.typing.ArrayLike, goals: numpy.typing.ArrayLike, poles: numpy.typing.ArrayLike | None = None, *, rotations: numpy.typing.ArrayLike | None = None, root: numpy.typing.ArrayLike | None = None, tolerance: float = 1e-06, iterations: typing.SupportsIndex = 100) -> sinew._types.Solution:
        """Finds rotations that bring the tips to the goals, by damped least squares on screws; each step moves all
        axes (Wampler 1986; Sugihara 2011).

        rest: [.., bones, 4, 4], [.., bones, 3, 4], [.., bones, 7] or [.., bones, 8]: each bone relative to its
            parent, not rotated. A matrix's linear part is replaced by the nearest rotation.
        tips: [.., effectors, 3], each in the space of its bone.
        goals: [.., effectors, ..], in any of these layouts: the goals of each tip's position and of its bone's
            rotation.
        poles: [.., effectors, 3], points; None if no effector has a pole.
        rotations: [.., bones, 4], the start; rotations beyond the limits are brought within. None: no rotation.
        root: [.., 4, 4], [.., 3, 4], [.., 7] or [.., 8], applied after the transform of every bone without a parent;
            None: the identity. Goals and poles are in the space that it maps to.
        tolerance: errors that count as reached, in lengths of the longest chain and in radians.
        iterations: maximum number of steps.

        If a chain with one effector whose rotation does not count can not reach its goal, the goal is moved to the
        nearest point of its range; a chain without limits stretches straight towards it. A straight chain that points
        at a nearer goal is bent a little about its first free axis. A pole on the line from root to goal is ignored.
        Limits can cause local minima: the result is within limits, and no step improves it. A chain with one effector
        is solved a second time, starting with a rotation to the goal, and the better result is used.
        """
def swing_twist_angles(rotations: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The angles that limits bound, [.., 3], radians. A rotation is decomposed into a twist about y, by the
    angle y, followed by a swing without twist; x and z are twice the arcsines of the x and z of its quaternion,
    so that for a swing about x alone x is its angle.

    rotations: [.., 4]; signs and lengths do not matter. For a swing by 180 degrees the twist is 0.
    """
