from __future__ import annotations
import numpy.typing
import sinew._types
import typing
__all__: list[str] = ['compose', 'from_axis_angle', 'from_rotation_matrix', 'from_screw', 'from_screw_about', 'from_translation', 'from_twist', 'identity', 'inverse', 'normalized', 'rigid_distance', 'to_affine', 'to_dual_quat', 'to_screw', 'to_twist', 'transform_normal', 'transform_point', 'transform_vector']
def compose(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The product a b, which applies `b` first: compose(model_from_bone, bone_from_rest) is
    model_from_rest.
    """
def from_axis_angle(axis: numpy.typing.ArrayLike, angle: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rotation by `angle` radians, [..], about `axis`, [.., 3], through the origin. The axis may have any
    length; 0 gives the identity.
    """
def from_rotation_matrix(rotation: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rotation by a matrix, [.., 3, 3]: a rotation to within 2e-3, or for sinew.affine any matrix."""
def from_screw(axis: numpy.typing.ArrayLike, moment: numpy.typing.ArrayLike, angle: numpy.typing.ArrayLike, translation: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rotation by `angle` radians about a line with a translation along it, both [..]; inverse of to_screw()
    (Daniilidis 1999, eq. 13).

    axis, moment: [.., 3], Pluecker coordinates of the line. Both are divided by the length of the axis, and a
        component of the moment along it is ignored. An axis of length 0 gives the identity.
    """
def from_screw_about(axis: numpy.typing.ArrayLike, point: numpy.typing.ArrayLike, angle: numpy.typing.ArrayLike, translation: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """As from_screw(), with the line given by any of its points, `point`, [.., 3]."""
def from_translation(translation: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The translation by `translation`, [.., 3]."""
def from_twist(twist: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The exponential of `twist`, [.., 6]: angular velocity, then linear velocity, of any angle."""
def identity(dtype: numpy.typing.DTypeLike = ...) -> numpy.typing.NDArray[typing.Any]:
    """The identity, one transform."""
def inverse(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The inverse of `a`. ValueError if the linear part of a matrix is singular."""
def normalized(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rigid transform nearest to `a`. A matrix's linear part becomes the nearest rotation (polar
    decomposition), or one of several, as for rank 0 or 1. A quaternion is divided by its length, a dual quaternion
    by its norm; 0 gives the identity.
    """
def rigid_distance(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> sinew._types.Distance[typing.Any]:
    """The distance of rigid `b` from rigid `a`, [..]: the angle of the rotation, 0 to pi, and the distance
    between the images of the origin. It is the same for compose(x, a) and compose(x, b) with rigid x.
    """
def to_affine(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """`a` in the layout of sinew.affine, [.., 4, 4]."""
def to_dual_quat(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """Rigid `a` in the layout of sinew.dual_quat, [.., 8]. The length of quaternions is not checked."""
def to_screw(a: numpy.typing.ArrayLike) -> sinew._types.Screw[typing.Any]:
    """The screw of rigid `a` (Chasles 1830).

    The angle is 0 to pi; at pi the axis has one of its two directions. The moment is point x axis. The pitch is
    translation / angle; it is infinite for a pure translation, for which the axis is its direction, angle and
    moment are 0 and translation >= 0. The axis of the identity is z.
    """
def to_twist(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The logarithm of rigid `a` in se(3), [.., 6]: angular, then linear, with an angle of 0 to pi. At 180
    degrees it has one of the two directions of the axis.
    """
def transform_normal(a: numpy.typing.ArrayLike, normals: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The unit normals, [.., 3], of surfaces after `a`: by the inverse transpose of a matrix. 0 for 0, and for a
    surface that becomes a line.
    """
def transform_point(a: numpy.typing.ArrayLike, points: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The images of `points`, [.., 3], under `a`. For n transforms of m points each, use a[:, None]."""
def transform_vector(a: numpy.typing.ArrayLike, vectors: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The images of `vectors`, [.., 3], under `a` without its translation."""
