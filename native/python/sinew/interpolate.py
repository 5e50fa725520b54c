# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens of two transforms and blends of many, by every method of METHODS.

method         layout     between two                        of many
matrix_linear  affine     component by component: not rigid  the same (Smith 2013, sections 2.3.1, 3.5.2)
matrix_polar   affine     the same, made rigid: the nearest rotation (Shoemake and Duff 1992)
matrix_log     affine     sum of logarithms in se(3)         the same (Alexa 2002): not the shortest path
qv_nlerp       quat_vec   normalised sum, mean translation   the same (Smith 2013, sections 2.2.1, 2.3.1)
qv_slerp       quat_vec   slerp, mean translation            mean on the sphere (Buss and Fillmore 2001)
dlb            dual_quat  normalised sum                     the same (Kavan et al. 2008, eq. 4)
sclerp, dib    dual_quat  ScLERP: the screw at constant      DIB (Kavan et al. 2008, algorithm 3)
                          pace (section 3.4)

Quaternions are first brought to one side, of the first of two or of the heaviest of many: the shorter way.
A transform composed to all of them goes through matrix_linear, dlb, sclerp and dib from either side: they do
not depend on where the origin is. qv_nlerp, qv_slerp and matrix_polar let it through from the left alone, and
depend on the origin. matrix_log lets a change of coordinates through, x a x^-1, and nothing else.

sclerp and dib are one under two names, that of two and that of many.

Of many, the order matters where several are the heaviest and wide apart: signs go by the first of them. Of
2,000 random blends of three with equal weights, up to 143 degrees from the identity, 13 % change with the
order (qv_nlerp, qv_slerp, dlb, dib); weights that differ leave one heaviest. Such a blend is not defined.
`sinew.fit.average` has no such choice.

Each result says whether it is defined. Not defined, and then:
  several that are the heaviest, and another order would give another blend: that of the first;
  rotations that are not of unit length to 1e-3, and for matrix_log matrices that scale, shear or mirror: what
    the formulas make of them;
  rotations half a turn from the first or the heaviest (qv_*, dlb, sclerp, dib): the signs as given decide;
  half a turn from the identity (matrix_log): one of the two directions of the axis;
  a sum that cancels: the heaviest transform (qv_nlerp, qv_slerp, matrix_polar: its rotation, and the mean of
    the translations);
  weights whose sum is not above 0, or a result beyond the element type: the heaviest transform;
  an iteration that does not settle (qv_slerp, dib): where it has come to;
  t beyond a thousandth of 1 / epsilon (qv_slerp, sclerp, dib): angles are then not known.
No result is NaN.
"""

from typing import Any, Final, Literal

from numpy.typing import ArrayLike

from ._native import interpolate as _native
from ._types import Blended

__all__ = ["METHODS", "Blended", "Method", "Signs", "between", "blend"]

Signs = Literal["heaviest", "running_sum", "as_given"]

Method = Literal[
    "matrix_linear", "matrix_polar", "matrix_log", "qv_nlerp", "qv_slerp", "dlb", "sclerp", "dib"
]

METHODS: Final[tuple[Method, ...]] = _native.METHODS


def between(a: ArrayLike, b: ArrayLike, t: ArrayLike, method: Method = "dlb") -> Blended[Any]:
    """From `a` at t = 0 to `b` at t = 1; other t go on beyond. Leading axes of a, b and t broadcast.

    a, b: in the layout of the method, rotations of unit length. The result is float32 where all arrays are of
        float32 or less, float64 otherwise.
    t: [..] or a number.

    Raises ValueError that names the argument, what was wanted and what came.
    """
    return Blended(*_native.between(a, b, t, method))


def blend(
    transforms: ArrayLike, weights: ArrayLike, method: Method = "dlb", signs: Signs = "heaviest"
) -> Blended[Any]:
    """The blend of the n transforms along the last leading axis; the axes before it broadcast.

    transforms: [.., n, 7] and so on, in the layout of the method, n >= 1, rotations of unit length.
    weights: [.., n], of any sign; brought to sum 1. Of two equal the first is the heavier.
    signs: what is done with the free signs of quaternions.

    heaviest     each in the hemisphere of the heaviest: the order does not matter but for ties
    running_sum  each in the hemisphere of the sum of those before it: as Blender's Preserve Volume and so
                 sinew.Deformer, for the same shapes; the order matters. Not defined where one is
                 perpendicular to that sum
    as_given     none is changed: for those that are aligned already, as along a spline

    Raises ValueError that names the argument, what was wanted and what came.
    """
    return Blended(*_native.blend(transforms, weights, method, signs))
