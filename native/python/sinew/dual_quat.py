# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms as unit dual quaternions real + e dual (DQ; Smith 2013, section 2.2.3).

Layout: [.., 8] as (w, x, y, z) of the real part, then of the dual part. Unit means |real| = 1 and dot(real,
dual) = 0. a and -a are the same transform.

All functions accept one transform or many: leading axes broadcast as in numpy, and numbers may be used
instead of arrays of numbers. Arrays may be anything that numpy converts to one. The result is float32 if all
arrays in a call are float32 or smaller, float64 otherwise, as numpy promotes; plain numbers do not count.
ValueError names the argument, what was expected and what was given; NaN and infinity are refused.
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
    """The quaternion conjugate, real* + e dual*: conjugate(a b) = conjugate(b) conjugate(a)."""
    return _native.conjugate(a)


def dual_conjugate(a: ArrayLike) -> NDArray[Any]:
    """The dual conjugate, real - e dual."""
    return _native.dual_conjugate(a)


def combined_conjugate(a: ArrayLike) -> NDArray[Any]:
    """Both conjugates, real* - e dual*: a (1 + e p) combined_conjugate(a) = 1 + e p', with p' the image
    of p."""
    return _native.combined_conjugate(a)


def norm(a: ArrayLike) -> NDArray[Any]:
    """sqrt(a conjugate(a)), a dual number, [.., 2]: (1, 0) for a unit `a`; (0, 0) if the real part is 0."""
    return _native.norm(a)


def log(a: ArrayLike) -> NDArray[Any]:
    """The logarithm of unit `a`: half the twist, with scalar parts of 0. Of a and -a, the one with w >= 0 is
    used.

    Source: Kavan et al. 2008, section 3.4.
    """
    return _native.log(a)


def exp(a: ArrayLike) -> NDArray[Any]:
    """The unit dual quaternion whose logarithm is `a`, of any angle. Scalar parts are ignored."""
    return _native.exp(a)


def power(a: ArrayLike, exponent: ArrayLike) -> NDArray[Any]:
    """The power of unit `a`: its screw with angle and translation multiplied by `exponent`, [..].

    Takes the shorter way: of a and -a, the one with w >= 0 is used. Source: Kavan et al. 2008, section 3.4.
    """
    return _native.power(a, exponent)
