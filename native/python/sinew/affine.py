# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms as 3x4 matrices, x -> linear x + translation.

Layout: [.., 4, 4] or [.., 3, 4], row-major, column vectors; a fourth row is not read, and results have it.
The linear part may scale and shear where a function does not say otherwise.

Every function takes one or many: leading axes broadcast as numpy's do, and numbers may stand for arrays of
numbers. All arrays of a call have one element type, float32 or float64, and so has the result. ValueError
names the argument, what was wanted and what came; NaN and infinity are refused.
"""

from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ._native import affine as _native
from ._types import Distance, Float, Number, ScaleSplit, Screw

__all__ = [
    "compose",
    "from_axis_angle",
    "from_rotation_matrix",
    "from_screw",
    "from_screw_about",
    "from_translation",
    "from_twist",
    "identity",
    "inverse",
    "normalized",
    "rigid_distance",
    "split_scale",
    "to_dual_quat",
    "to_quat_vec",
    "to_screw",
    "to_twist",
    "transform_normal",
    "transform_point",
    "transform_vector",
]


@overload
def identity() -> NDArray[np.float64]: ...
@overload
def identity(dtype: type[Float]) -> NDArray[Float]: ...
def identity(dtype: Any = np.float64) -> NDArray[Any]:
    """The identity, [4, 4]."""
    return np.eye(4, dtype=dtype)


def from_axis_angle(axis: NDArray[Float], angle: Number) -> NDArray[Float]:
    """The turn by `angle` radians about `axis` through the origin, [.., 4, 4].

    axis: [.., 3], of any length; one of length 0 gives the identity. angle: [..].
    """
    return _native.from_axis_angle(axis, angle)


def from_rotation_matrix(rotation: NDArray[Float]) -> NDArray[Float]:
    """The turn of `rotation`, [.., 3, 3], taken as it is."""
    return _native.from_rotation_matrix(rotation)


def from_translation(translation: NDArray[Float]) -> NDArray[Float]:
    """The shift by `translation`, [.., 3]."""
    return _native.from_translation(translation)


def from_screw(
    axis: NDArray[Float], moment: NDArray[Float], angle: Number, translation: Number
) -> NDArray[Float]:
    """The turn by `angle` radians about a line and the shift by `translation` along it; undoes to_screw().

    axis, moment: [.., 3], Pluecker coordinates of the line: both are divided by the length of the axis, and
        a part of the moment along it is left out. An axis of length 0 gives the identity.
    angle, translation: [..]; a pitch (translation per radian) gives translation = pitch * angle.

    Source: Daniilidis 1999, eq. 13.
    """
    return _native.from_screw(axis, moment, angle, translation)


def from_screw_about(
    axis: NDArray[Float], point: NDArray[Float], angle: Number, translation: Number
) -> NDArray[Float]:
    """As from_screw(), with the line given by `point`, [.., 3], any point on it."""
    return _native.from_screw_about(axis, point, angle, translation)


def to_screw(a: NDArray[Float]) -> Screw[Float]:
    """The screw that rigid `a` is (Chasles 1830): axis and moment [.., 3], angle, translation and pitch [..].

    angle: 0 to pi; at pi the axis is one of its two directions. moment: point x axis. pitch: translation /
    angle; infinite for a shift alone, whose axis is its direction, angle and moment 0, translation >= 0. The
    identity has the axis z.
    """
    return Screw(*_native.to_screw(a))


def from_twist(twist: NDArray[Float]) -> NDArray[Float]:
    """The exponential of `twist`, [.., 6]: angular velocity, linear velocity; of any angle."""
    return _native.from_twist(twist)


def to_twist(a: NDArray[Float]) -> NDArray[Float]:
    """The logarithm of rigid `a` in se(3), [.., 6]: angular, then linear, the angle 0 to pi.

    At half a turn both directions of the axis are logarithms, and the result has one of them.
    """
    return _native.to_twist(a)


def to_quat_vec(a: NDArray[Float]) -> NDArray[Float]:
    """`a` in the layout of sinew.quat_vec, [.., 7]; `a` must be rigid, as normalized() makes it."""
    return _native.to_quat_vec(a)


def to_dual_quat(a: NDArray[Float]) -> NDArray[Float]:
    """`a` in the layout of sinew.dual_quat, [.., 8]; `a` must be rigid, as normalized() makes it."""
    return _native.to_dual_quat(a)


def compose(a: NDArray[Float], b: NDArray[Float]) -> NDArray[Float]:
    """First `b`, then `a`: compose(model_from_bone, bone_from_rest) = model_from_rest."""
    return _native.compose(a, b)


def inverse(a: NDArray[Float]) -> NDArray[Float]:
    """The transform that undoes `a`. ValueError where its linear part has determinant 0."""
    return _native.inverse(a)


def normalized(a: NDArray[Float]) -> NDArray[Float]:
    """The rigid transform nearest to `a`: its linear part becomes the nearest rotation (polar decomposition).

    A linear part that is zero or all on one line gives one of several as near.
    """
    return _native.normalized(a)


def transform_point(a: NDArray[Float], points: NDArray[Float]) -> NDArray[Float]:
    """Where `a` takes `points`, [.., 3]. n transforms of m points each: a[:, None]."""
    return _native.transform_point(a, points)


def transform_vector(a: NDArray[Float], vectors: NDArray[Float]) -> NDArray[Float]:
    """`vectors`, [.., 3], after `a`: its linear part, no shift."""
    return _native.transform_vector(a, vectors)


def transform_normal(a: NDArray[Float], normals: NDArray[Float]) -> NDArray[Float]:
    """Unit normals, [.., 3], of surfaces after `a`: along the inverse transpose of its linear part.

    Where `a` flattens the surface to a line the result is 0.
    """
    return _native.transform_normal(a, normals)


def rigid_distance(a: NDArray[Float], b: NDArray[Float]) -> Distance[Float]:
    """Angle of the turn from `a` to `b`, 0 to pi, and distance between where they take the origin; both [..].

    The same for compose(x, a) and compose(x, b), x rigid. `a` and `b` must be rigid.
    """
    return Distance(*_native.rigid_distance(a, b))


def split_scale(posed_from_rest: NDArray[Float], rest_bone: NDArray[Float]) -> ScaleSplit[Float]:
    """A bone's motion in two, posed_from_rest = rigid * scale: what methods that blend rigid motions need.

    posed_from_rest  where the motion takes points of the rest shape; may scale, shear and mirror
    rest_bone        the bone's rest axes, Y along the bone, and head in the same space; orthonormal

    Axes are made square keeping Y, as Blender's Armature modifier does for Preserve Volume; a mirror is in
    `scale`. A motion within 1e-5 of orthonormal and 1e-4 of unit size has the identity for `scale`. `rigid`
    is a rotation and a shift also where axes vanish.
    """
    return ScaleSplit(*_native.split_scale(posed_from_rest, rest_bone))
