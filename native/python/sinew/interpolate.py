# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolation between two transforms and blends of many, by each method of METHODS.

method         layout     between two                        of many
matrix_linear  affine     component by component: not rigid  the same (Smith 2013, sections 2.3.1, 3.5.2)
matrix_polar   affine     the same, made rigid: the nearest rotation (Shoemake and Duff 1992)
matrix_log     affine     sum of logarithms in se(3)         the same (Alexa 2002): not the shortest path
qv_nlerp       quat_vec   normalised sum, mean translation   the same (Smith 2013, sections 2.2.1, 2.3.1)
qv_slerp       quat_vec   slerp, mean translation            mean on the sphere (Buss and Fillmore 2001)
dlb            dual_quat  normalised sum                     the same (Kavan et al. 2008, eq. 4)
sclerp, dib    dual_quat  ScLERP: the screw at constant      DIB (Kavan et al. 2008, algorithm 3)
                          speed (section 3.4)

Signs of quaternions are first chosen to be in the hemisphere of the first of two, or of the heaviest of
many: the shorter way. If all transforms are composed with another one, from either side, the results of
matrix_linear, dlb, sclerp and dib are composed with it as well: they do not depend on the origin. For
qv_nlerp, qv_slerp and matrix_polar this only holds from the left: they depend on the origin. For matrix_log
it only holds for a change of coordinates, x a x^-1.

sclerp and dib are the same method, named after its interpolation of two and its blend of many.

In a blend of many, the order matters if several transforms are the heaviest and far apart, since signs
follow the first of them. Of 2,000 random blends of three transforms with equal weights, up to 143 degrees
from the identity, 13 % change with the order (qv_nlerp, qv_slerp, dlb, dib); different weights leave a
single heaviest. Such a blend is not defined.

Each result says whether it is defined. It is not defined in these cases, and is then:
  several heaviest transforms, and another order would give another blend: the one of the first;
  rotations that are not of unit length to within 1e-3, and for matrix_log matrices that scale, shear or
    mirror: what the formulas give;
  rotations 180 degrees from the first or the heaviest (qv_*, dlb, sclerp, dib): the signs as given decide;
  180 degrees from the identity (matrix_log): one of the two directions of the axis;
  a sum that cancels: the heaviest transform (qv_nlerp, qv_slerp, matrix_polar: its rotation, and the mean of
    the translations);
  weights whose sum is not positive, or a result beyond the element type: the heaviest transform;
  an iteration that does not converge (qv_slerp, dib): its last value;
  |t| beyond 0.001 / epsilon (qv_slerp, sclerp, dib): angles are then imprecise.
No result is NaN.
"""

from typing import Final, Literal

from ._native import interpolate as _native
from ._native.interpolate import between, blend
from ._types import Blended

__all__ = ["METHODS", "Blended", "Method", "Signs", "between", "blend"]

Signs = Literal["heaviest", "running_sum", "as_given"]

Method = Literal[
    "matrix_linear", "matrix_polar", "matrix_log", "qv_nlerp", "qv_slerp", "dlb", "sclerp", "dib"
]

METHODS: Final[tuple[Method, ...]] = _native.METHODS
