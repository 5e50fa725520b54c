# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations as unit quaternions w + xi + yj + zk (Smith 2013, section 2.1).

Layout: [.., 4] as (w, x, y, z). q and -q are the same rotation. With a translation: sinew.quat_vec.

All functions accept one quaternion or many: leading axes broadcast as in numpy, and numbers may be used
instead of arrays of numbers. The result is float32 if all arrays in a call are float32 or smaller, float64
otherwise. ValueError names the argument, what was expected and what was given; NaN and infinity are refused.
"""

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ._native import quat as _native

__all__ = [
    "angle_between",
    "compose",
    "conjugate",
    "from_axis_angle",
    "from_rotation_matrix",
    "from_rotation_vector",
    "from_three_numbers",
    "norm",
    "normalized",
    "rotate",
    "slerp",
    "to_rotation_matrix",
    "to_rotation_vector",
    "to_three_numbers",
]


def from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> NDArray[Any]:
    """The rotation by `angle` radians, [..], about `axis`, [.., 3]. Any length; 0 gives the identity."""
    return _native.from_axis_angle(axis, angle)


def from_rotation_vector(vector: ArrayLike) -> NDArray[Any]:
    """The rotation about `vector`, [.., 3], by its length in radians, of any size."""
    return _native.from_rotation_vector(vector)


def to_rotation_vector(q: ArrayLike) -> NDArray[Any]:
    """Axis times angle of unit `q`, [.., 3], with a length of 0 to pi; at pi the signs of `q` decide its
    direction."""
    return _native.to_rotation_vector(q)


def from_rotation_matrix(rotation: ArrayLike) -> NDArray[Any]:
    """The quaternion of `rotation`, [.., 3, 3], with w >= 0. ValueError if it is no rotation."""
    return _native.from_rotation_matrix(rotation)


def to_rotation_matrix(q: ArrayLike) -> NDArray[Any]:
    """The rotation matrix of unit `q`, [.., 3, 3]."""
    return _native.to_rotation_matrix(q)


def compose(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """The product a b (Hamilton), which applies the rotation `b` first."""
    return _native.compose(a, b)


def conjugate(q: ArrayLike) -> NDArray[Any]:
    """The conjugate w - xi - yj - zk: the inverse of a unit quaternion."""
    return _native.conjugate(q)


def norm(q: ArrayLike) -> NDArray[Any]:
    """The length, [..]."""
    return _native.norm(q)


def normalized(q: ArrayLike) -> NDArray[Any]:
    """`q` normalised; length 0 gives the identity."""
    return _native.normalized(q)


def rotate(q: ArrayLike, vectors: ArrayLike) -> NDArray[Any]:
    """q v q*: the images of `vectors`, [.., 3], under the rotation by unit `q`."""
    return _native.rotate(q, vectors)


def angle_between(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """The angle of the rotation from `a` to `b`, [..], 0 to pi; signs do not matter."""
    return _native.angle_between(a, b)


def slerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> NDArray[Any]:
    """Interpolates from `a` at t = 0 to `b` at t = 1 at constant speed, along the shorter way (Shoemake
    1985).

    At 180 degrees the signs as given decide; sinew.interpolate.between with "qv_slerp" reports where that
    happens.
    """
    return _native.slerp(a, b, t)


def to_three_numbers(q: ArrayLike) -> NDArray[Any]:
    """x, y and z of `q` or -q, whichever has w >= 0, [.., 3], for storage (Smith 2013, section 3.3)."""
    return _native.to_three_numbers(q)


def from_three_numbers(numbers: ArrayLike) -> NDArray[Any]:
    """The inverse of to_three_numbers(): w is computed from the unit length.

    Near 180 degrees w is small and imprecise: its error is up to the square root of the type's rounding
    error, 3e-4 for float32.
    """
    return _native.from_three_numbers(numbers)
