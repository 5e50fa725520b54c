# SPDX-License-Identifier: GPL-3.0-or-later
"""The functions that sinew.affine, sinew.quat_vec and sinew.dual_quat have in common.

[..] stands for leading axes; `layout` for the last axes of the representation: [4, 4], [7] or [8].
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

        axis: [.., 3], of any length; length 0 gives the identity. angle: [..].
        """
        return self._native.from_axis_angle(axis, angle)

    def from_rotation_matrix(self, rotation: ArrayLike) -> NDArray[Any]:
        """The given rotation, [.., 3, 3].

        ValueError if it is no rotation to within 2e-3; sinew.affine accepts any matrix.
        """
        return self._native.from_rotation_matrix(rotation)

    def from_translation(self, translation: ArrayLike) -> NDArray[Any]:
        """The translation by `translation`, [.., 3]."""
        return self._native.from_translation(translation)

    def from_screw(
        self, axis: ArrayLike, moment: ArrayLike, angle: ArrayLike, translation: ArrayLike
    ) -> NDArray[Any]:
        """The screw with a rotation by `angle` radians about a line and a translation along it; inverse of
        to_screw().

        axis, moment: [.., 3], Pluecker coordinates of the line. Both are divided by the length of the axis,
            and a component of the moment along it is ignored. An axis of length 0 gives the identity.
        angle, translation: [..]. For a pitch (translation per radian), use translation = pitch * angle.

        Source: Daniilidis 1999, eq. 13.
        """
        return self._native.from_screw(axis, moment, angle, translation)

    def from_screw_about(
        self, axis: ArrayLike, point: ArrayLike, angle: ArrayLike, translation: ArrayLike
    ) -> NDArray[Any]:
        """As from_screw(), with the line given by any of its points, `point`, [.., 3]."""
        return self._native.from_screw_about(axis, point, angle, translation)

    def to_screw(self, a: ArrayLike) -> Screw[Any]:
        """The screw of rigid `a` (Chasles 1830). ValueError if a matrix scales, shears or mirrors.

        axis and moment [.., 3], angle, translation and pitch [..].
        angle: 0 to pi; at pi the axis has one of its two directions. moment: point x axis.
        pitch: translation / angle; infinite for a pure translation, for which the axis is its direction,
            angle and moment are 0 and translation >= 0. The axis of the identity is z.
        """
        return Screw(*self._native.to_screw(a))

    def from_twist(self, twist: ArrayLike) -> NDArray[Any]:
        """The exponential of `twist`, [.., 6]: angular velocity, then linear velocity, of any angle."""
        return self._native.from_twist(twist)

    def to_twist(self, a: ArrayLike) -> NDArray[Any]:
        """The logarithm of rigid `a` in se(3), [.., 6]: angular, then linear, with an angle of 0 to pi.

        At 180 degrees both directions of the axis are logarithms, and the result has one of them. ValueError
        if a matrix scales, shears or mirrors.
        """
        return self._native.to_twist(a)

    def to_affine(self, a: ArrayLike) -> NDArray[Any]:
        """`a` in the layout of sinew.affine, [.., 4, 4]."""
        return self._native.to_affine(a)

    def to_quat_vec(self, a: ArrayLike) -> NDArray[Any]:
        """`a` in the layout of sinew.quat_vec, [.., 7]. `a` must be rigid, as normalized() makes it.

        ValueError if a matrix scales, shears or mirrors. The length of quaternions is not checked.
        """
        return self._native.to_quat_vec(a)

    def to_dual_quat(self, a: ArrayLike) -> NDArray[Any]:
        """`a` in the layout of sinew.dual_quat, [.., 8]. `a` must be rigid, as normalized() makes it.

        ValueError if a matrix scales, shears or mirrors. The length of quaternions is not checked.
        """
        return self._native.to_dual_quat(a)

    def compose(self, a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
        """The product a b, which applies `b` first: compose(model_from_bone, bone_from_rest) =
        model_from_rest."""
        return self._native.compose(a, b)

    def inverse(self, a: ArrayLike) -> NDArray[Any]:
        """The inverse of `a`; for a unit dual quaternion its conjugate().

        ValueError if the linear part of a matrix is singular.
        """
        return self._native.inverse(a)

    def normalized(self, a: ArrayLike) -> NDArray[Any]:
        """The rigid transform nearest to `a`.

        Matrix: the linear part becomes the nearest rotation (polar decomposition); if that is not unique, as
            for rank 0 or 1, one of the nearest.
        Quaternion and vector: the quaternion is normalised; length 0 gives the identity.
        Dual quaternion: divided by its norm(); a real part of 0 gives the identity.
        """
        return self._native.normalized(a)

    def transform_point(self, a: ArrayLike, points: ArrayLike) -> NDArray[Any]:
        """The images of `points`, [.., 3], under `a`. For n transforms of m points each, use a[:, None]."""
        return self._native.transform_point(a, points)

    def transform_vector(self, a: ArrayLike, vectors: ArrayLike) -> NDArray[Any]:
        """The images of `vectors`, [.., 3], under `a` without its translation."""
        return self._native.transform_vector(a, vectors)

    def transform_normal(self, a: ArrayLike, normals: ArrayLike) -> NDArray[Any]:
        """The unit normals, [.., 3], of surfaces after `a`; (0, 0, 0) gives (0, 0, 0).

        A matrix transforms normals by the inverse transpose of its linear part; if that flattens the surface
        to a line, the result is 0.
        """
        return self._native.transform_normal(a, normals)

    def rigid_distance(self, a: ArrayLike, b: ArrayLike) -> Distance[Any]:
        """The distance of `b` from `a`, [..]: angle of the rotation, 0 to pi, and distance between the
        images of the origin.

        The same for compose(x, a) and compose(x, b) with rigid x. `a` and `b` must be rigid: ValueError if a
        matrix scales, shears or mirrors.
        """
        return Distance(*self._native.rigid_distance(a, b))
