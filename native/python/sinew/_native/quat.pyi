from __future__ import annotations
import numpy.typing
import typing
__all__: list[str] = ['angle_between', 'compose', 'conjugate', 'from_axis_angle', 'from_rotation_matrix', 'from_rotation_vector', 'from_three_numbers', 'norm', 'normalized', 'rotate', 'slerp', 'to_rotation_matrix', 'to_rotation_vector', 'to_three_numbers']
def angle_between(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The angle of the rotation from `a` to `b`, [..], 0 to pi; signs do not matter."""
def compose(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The product a b (Hamilton), which applies the rotation `b` first."""
def conjugate(q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The conjugate w - xi - yj - zk: the inverse of a unit quaternion."""
def from_axis_angle(axis: numpy.typing.ArrayLike, angle: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rotation by `angle` radians, [..], about `axis`, [.., 3], of any length; 0 gives the identity."""
def from_rotation_matrix(rotation: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The quaternion of a matrix, [.., 3, 3], with w >= 0. ValueError if it is no rotation."""
def from_rotation_vector(vector: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rotation about `vector`, [.., 3], by its length in radians, of any size."""
def from_three_numbers(numbers: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The inverse of to_three_numbers(): w is computed from the unit length.

    Near 180 degrees w is small and imprecise: its error is up to the square root of the type's rounding error,
    3e-4 for float32.
    """
def norm(q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The length, [..]."""
def normalized(q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """`q` divided by its length; length 0 gives the identity."""
def rotate(q: numpy.typing.ArrayLike, vectors: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """q v q*: the images of `vectors`, [.., 3], under the rotation by unit `q`."""
def slerp(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike, t: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """Interpolates from `a` at t = 0 to `b` at t = 1 at constant speed, along the shorter way (Shoemake
    1985).

    At 180 degrees the signs as given decide; sinew.interpolate.between with "qv_slerp" reports where that
    happens.
    """
def to_rotation_matrix(q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The rotation matrix of unit `q`, [.., 3, 3]."""
def to_rotation_vector(q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """Axis times angle of unit `q`, [.., 3], with a length of 0 to pi; at pi the signs of `q` decide its
    direction.
    """
def to_three_numbers(q: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """x, y and z of `q` or -q, whichever has w >= 0, [.., 3], for storage (Smith 2013, section 3.3)."""
