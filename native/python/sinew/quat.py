# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations as unit quaternions w + xi + yj + zk (Smith 2013, section 2.1).

Layout: [.., 4] as (w, x, y, z). q and -q are one rotation. With a translation: sinew.quat_vec.

Every function takes one or many: leading axes broadcast as numpy's do, and numbers may stand for arrays of
numbers. The result is float32 where all arrays of a call are of float32 or less, float64 otherwise.
ValueError names the argument, what was wanted and what came; NaN and infinity are refused.
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
    """The rotation by `angle` radians, [..], about `axis`, [.., 3], of any length; of length 0 none."""
    return _native.from_axis_angle(axis, angle)


def from_rotation_vector(vector: ArrayLike) -> NDArray[Any]:
    """The rotation about `vector`, [.., 3], by its length in radians, of any size."""
    return _native.from_rotation_vector(vector)


def to_rotation_vector(q: ArrayLike) -> NDArray[Any]:
    """Axis times angle of unit `q`, [.., 3], 0 to pi long; at pi the signs of `q` decide its direction."""
    return _native.to_rotation_vector(q)


def from_rotation_matrix(rotation: ArrayLike) -> NDArray[Any]:
    """The quaternion of `rotation`, [.., 3, 3], with w >= 0. ValueError where it is no rotation."""
    return _native.from_rotation_matrix(rotation)


def to_rotation_matrix(q: ArrayLike) -> NDArray[Any]:
    """The matrix of unit `q`, [.., 3, 3]."""
    return _native.to_rotation_matrix(q)


def compose(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """a b, Hamilton's product: first the rotation `b`, then `a`."""
    return _native.compose(a, b)


def conjugate(q: ArrayLike) -> NDArray[Any]:
    """w - xi - yj - zk: the rotation back, of a unit quaternion."""
    return _native.conjugate(q)


def norm(q: ArrayLike) -> NDArray[Any]:
    """The length, [..]."""
    return _native.norm(q)


def normalized(q: ArrayLike) -> NDArray[Any]:
    """`q` at length 1; one of length 0 gives the identity."""
    return _native.normalized(q)


def rotate(q: ArrayLike, vectors: ArrayLike) -> NDArray[Any]:
    """q v q*: `vectors`, [.., 3], after the rotation by unit `q`."""
    return _native.rotate(q, vectors)


def angle_between(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """The angle of the rotation from `a` to `b`, [..], 0 to pi; signs do not matter."""
    return _native.angle_between(a, b)


def slerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> NDArray[Any]:
    """From `a` at t = 0 to `b` at t = 1 at constant pace, the shorter way (Shoemake 1985).

    At half a turn the signs as given decide; sinew.interpolate.between by "qv_slerp" says where.
    """
    return _native.slerp(a, b, t)


def to_three_numbers(q: ArrayLike) -> NDArray[Any]:
    """x, y and z of `q` or -q, whichever has w >= 0, [.., 3]: to store it (Smith 2013, section 3.3)."""
    return _native.to_three_numbers(q)


def from_three_numbers(numbers: ArrayLike) -> NDArray[Any]:
    """Undoes to_three_numbers(): w is the root of what is missing to length 1.

    Near half a turn, where w is small, it is lost: off by up to the root of the type's rounding, 3e-4 in
    float32.
    """
    return _native.from_three_numbers(numbers)
