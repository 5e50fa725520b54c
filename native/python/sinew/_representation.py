# SPDX-License-Identifier: GPL-3.0-or-later
"""What sinew.affine, sinew.quat_vec and sinew.dual_quat have alike: the functions of a Representation.

Sizes [..] are of leading axes; `layout` stands for the last axes of the representation: [4, 4], [7] or [8].
"""

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._types import Distance, Screw


class Representation:
    """The functions of one representation of rigid transforms."""

    def __init__(self, native: ModuleType, identity: NDArray[np.float64]) -> None:
        self._native = native
        self._identity = identity

    def identity(self, dtype: Any = np.float64) -> NDArray[Any]:
        """The identity, [layout]."""
        return self._identity.astype(dtype)

    def from_axis_angle(self, axis: ArrayLike, angle: ArrayLike) -> NDArray[Any]:
        """The rotation by `angle` radians about `axis` through the origin, [.., layout].

        axis: [.., 3], of any length; one of length 0 gives the identity. angle: [..].
        """
        return self._native.from_axis_angle(axis, angle)

    def from_rotation_matrix(self, rotation: ArrayLike) -> NDArray[Any]:
        """The rotation of `rotation`, [.., 3, 3].

        ValueError where it is no rotation, to 2e-3; sinew.affine takes any matrix as it is.
        """
        return self._native.from_rotation_matrix(rotation)

    def from_translation(self, translation: ArrayLike) -> NDArray[Any]:
        """The translation by `translation`, [.., 3]."""
        return self._native.from_translation(translation)

    def from_screw(
        self, axis: ArrayLike, moment: ArrayLike, angle: ArrayLike, translation: ArrayLike
    ) -> NDArray[Any]:
        """The rotation by `angle` radians about a line and the translation along it; undoes to_screw().

        axis, moment: [.., 3], Pluecker coordinates of the line: both are divided by the length of the axis,
            and a part of the moment along it is left out. An axis of length 0 gives the identity.
        angle, translation: [..]; a pitch (translation per radian) gives translation = pitch * angle.

        Source: Daniilidis 1999, eq. 13.
        """
        return self._native.from_screw(axis, moment, angle, translation)

    def from_screw_about(
        self, axis: ArrayLike, point: ArrayLike, angle: ArrayLike, translation: ArrayLike
    ) -> NDArray[Any]:
        """As from_screw(), with the line given by `point`, [.., 3], any point on it."""
        return self._native.from_screw_about(axis, point, angle, translation)

    def to_screw(self, a: ArrayLike) -> Screw[Any]:
        """The screw that rigid `a` is (Chasles 1830). ValueError where a matrix scales, shears or mirrors.

        axis and moment [.., 3], angle, translation and pitch [..].
        angle: 0 to pi; at pi the axis is one of its two directions. moment: point x axis.
        pitch: translation / angle; infinite for a translation alone, whose axis is its direction, angle and
            moment 0, translation >= 0. The identity has the axis z.
        """
        return Screw(*self._native.to_screw(a))

    def from_twist(self, twist: ArrayLike) -> NDArray[Any]:
        """The exponential of `twist`, [.., 6]: angular velocity, linear velocity; of any angle."""
        return self._native.from_twist(twist)

    def to_twist(self, a: ArrayLike) -> NDArray[Any]:
        """The logarithm of rigid `a` in se(3), [.., 6]: angular, then linear, the angle 0 to pi.

        At 180 degrees both directions of the axis are logarithms, and the result has one of them. ValueError
        where a matrix scales, shears or mirrors.
        """
        return self._native.to_twist(a)

    def to_affine(self, a: ArrayLike) -> NDArray[Any]:
        """`a` in the layout of sinew.affine, [.., 4, 4]."""
        return self._native.to_affine(a)

    def to_quat_vec(self, a: ArrayLike) -> NDArray[Any]:
        """`a` in the layout of sinew.quat_vec, [.., 7]; `a` must be rigid, as normalized() makes it.

        ValueError where a matrix scales, shears or mirrors; the length of quaternions is not looked at.
        """
        return self._native.to_quat_vec(a)

    def to_dual_quat(self, a: ArrayLike) -> NDArray[Any]:
        """`a` in the layout of sinew.dual_quat, [.., 8]; `a` must be rigid, as normalized() makes it.

        ValueError where a matrix scales, shears or mirrors; the length of quaternions is not looked at.
        """
        return self._native.to_dual_quat(a)

    def compose(self, a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
        """First `b`, then `a`: compose(model_from_bone, bone_from_rest) = model_from_rest."""
        return self._native.compose(a, b)

    def inverse(self, a: ArrayLike) -> NDArray[Any]:
        """The transform that undoes `a`; of a unit dual quaternion conjugate().

        ValueError where the linear part of a matrix has determinant 0.
        """
        return self._native.inverse(a)

    def normalized(self, a: ArrayLike) -> NDArray[Any]:
        """The rigid transform nearest to `a`.

        A matrix: its linear part becomes the nearest rotation (polar decomposition); one that is zero or all
            on one line gives one of several as near.
        A quaternion and a vector: the quaternion at unit length; one of length 0 becomes that of the
            identity.
        A dual quaternion: divided by its norm(); a real part of length 0 gives the identity.
        """
        return self._native.normalized(a)

    def transform_point(self, a: ArrayLike, points: ArrayLike) -> NDArray[Any]:
        """Where `a` takes `points`, [.., 3]. n transforms of m points each: a[:, None]."""
        return self._native.transform_point(a, points)

    def transform_vector(self, a: ArrayLike, vectors: ArrayLike) -> NDArray[Any]:
        """`vectors`, [.., 3], after `a`: without its translation."""
        return self._native.transform_vector(a, vectors)

    def transform_normal(self, a: ArrayLike, normals: ArrayLike) -> NDArray[Any]:
        """Unit normals, [.., 3], of surfaces after `a`; (0, 0, 0) stays.

        A matrix takes them along the inverse transpose of its linear part: where it flattens the surface to a
        line the result is 0.
        """
        return self._native.transform_normal(a, normals)

    def rigid_distance(self, a: ArrayLike, b: ArrayLike) -> Distance[Any]:
        """How far `b` is from `a`, [..]: angle of the rotation, 0 to pi, and distance of the origin's images.

        The same for compose(x, a) and compose(x, b), x rigid. `a` and `b` must be rigid: ValueError where a
        matrix scales, shears or mirrors.
        """
        return Distance(*self._native.rigid_distance(a, b))
