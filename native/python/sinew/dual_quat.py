# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms as unit dual quaternions real + e dual (DQ; Smith 2013, section 2.2.3).

Layout: [.., 8] as (w, x, y, z) of the real part, then of the dual. Unit: |real| = 1 and dot(real, dual) = 0.
a and -a are one transform.

Every function takes one or many: leading axes broadcast as numpy's do, and numbers may stand for arrays of
numbers. Arrays are anything that numpy makes one of. The result is float32 where all arrays of a call are of
float32 or less, float64 otherwise, as numpy promotes; numbers do not count. ValueError names the argument,
what was wanted and what came; NaN and infinity are refused.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._native import dual_quat as _native
from ._representation import Representation

__all__ = [
    "combined_conjugate",
    "compose",
    "conjugate",
    "dual_conjugate",
    "exp",
    "from_axis_angle",
    "from_rotation_matrix",
    "from_screw",
    "from_screw_about",
    "from_translation",
    "from_twist",
    "identity",
    "inverse",
    "log",
    "norm",
    "normalized",
    "power",
    "rigid_distance",
    "to_affine",
    "to_quat_vec",
    "to_screw",
    "to_twist",
    "transform_normal",
    "transform_point",
    "transform_vector",
]

_layout = Representation(_native, np.eye(1, 8)[0])

compose = _layout.compose
from_axis_angle = _layout.from_axis_angle
from_rotation_matrix = _layout.from_rotation_matrix
from_screw = _layout.from_screw
from_screw_about = _layout.from_screw_about
from_translation = _layout.from_translation
from_twist = _layout.from_twist
identity = _layout.identity
inverse = _layout.inverse
normalized = _layout.normalized
rigid_distance = _layout.rigid_distance
to_affine = _layout.to_affine
to_quat_vec = _layout.to_quat_vec
to_screw = _layout.to_screw
to_twist = _layout.to_twist
transform_normal = _layout.transform_normal
transform_point = _layout.transform_point
transform_vector = _layout.transform_vector


def conjugate(a: ArrayLike) -> NDArray[Any]:
    """real* + e dual*, the quaternion conjugate: conjugate(a b) = conjugate(b) conjugate(a)."""
    return _native.conjugate(a)


def dual_conjugate(a: ArrayLike) -> NDArray[Any]:
    """real - e dual, the dual conjugate."""
    return _native.dual_conjugate(a)


def combined_conjugate(a: ArrayLike) -> NDArray[Any]:
    """real* - e dual*, both: a (1 + e p) combined_conjugate(a) is 1 + e p', p' where `a` takes p."""
    return _native.combined_conjugate(a)


def norm(a: ArrayLike) -> NDArray[Any]:
    """sqrt(a conjugate(a)), a dual number, [.., 2]: 1, 0 of a unit one; 0, 0 where the real part is 0."""
    return _native.norm(a)


def log(a: ArrayLike) -> NDArray[Any]:
    """The logarithm of unit `a`, without scalar parts: half the twist. Of a and -a that with w >= 0 is taken.

    Source: Kavan et al. 2008, section 3.4.
    """
    return _native.log(a)


def exp(a: ArrayLike) -> NDArray[Any]:
    """The unit dual quaternion whose logarithm is `a`, of any angle. Scalar parts are not read."""
    return _native.exp(a)


def power(a: ArrayLike, exponent: ArrayLike) -> NDArray[Any]:
    """Unit `a` done `exponent` times, [..]: its screw with angle and translation times `exponent`.

    The shorter way: of a and -a that with w >= 0 is taken. Source: Kavan et al. 2008, section 3.4.
    """
    return _native.power(a, exponent)
