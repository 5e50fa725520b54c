from __future__ import annotations
import numpy.typing
import sinew._types
import sinew.interpolate
import typing
__all__: list[str] = ['METHODS', 'between', 'blend']
def between(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike, t: numpy.typing.ArrayLike, method: sinew.interpolate.Method = 'dlb') -> sinew._types.Blended[typing.Any]:
    """Interpolates from `a` at t = 0 to `b` at t = 1; other t extrapolate.

    a, b: in the layout of the method, with rotations of unit length.
    t: [..] or a number.
    """
def blend(transforms: numpy.typing.ArrayLike, weights: numpy.typing.ArrayLike, method: sinew.interpolate.Method = 'dlb', signs: sinew.interpolate.Signs = 'heaviest') -> sinew._types.Blended[typing.Any]:
    """The blend of the n transforms along the last leading axis; the axes before it broadcast.

    transforms: [.., n, 7] and so on, in the layout of the method, n >= 1, with rotations of unit length.
    weights: [.., n], of any sign, normalised to sum 1. Of two equal ones the first counts as the heavier.
    signs: how the free signs of quaternions are chosen.

    heaviest     each in the hemisphere of the heaviest: the order does not matter except for ties
    running_sum  each in the hemisphere of the sum of those before it, as Blender's Preserve Volume and
                 sinew.Deformer do, for the same shapes; the order matters. Not defined if one is
                 perpendicular to that sum
    as_given     unchanged: for transforms that are aligned already, such as along a spline
    """
METHODS: tuple = ('matrix_linear', 'matrix_polar', 'matrix_log', 'qv_nlerp', 'qv_slerp', 'dlb', 'sclerp', 'dib')
