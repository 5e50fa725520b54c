# SPDX-License-Identifier: GPL-3.0-or-later
"""Splines through transforms or points at given times (Catmull and Rom 1974; Smith 2013, section 2.3.2).

keys   [n, 4, 4], [n, 3, 4], [n, 7] or [n, 8], n >= 1, rotations of unit length; or [n, 3], points, for
       catmull_rom_vector() and hermite()
times  [n], non-decreasing. The curve is constant before the first time and after the last. Keys of equal
       time are a cut: the curve ends at the first of them and starts again at the last
at     [..] or a number: the times at which to evaluate the curve

For Catmull-Rom splines the tangent at an inner key is (next - previous) / (difference of their times),
scaled to each interval; at an end it has the direction of the straight line to the next key. Signs of
quaternions are chosen along the chain of keys, so that adjacent keys are in one hemisphere.

Not defined if keys in use are 180 degrees apart (quaternions; the signs as given then decide), or if the
blend is not defined (sinew.interpolate). ValueError names the argument, what was expected and what was
given.
"""

from typing import Any

from numpy.typing import ArrayLike

from ._native import spline as _native
from ._types import Blended
from .interpolate import Method

__all__ = ["Blended", "catmull_rom", "catmull_rom_vector", "hermite"]


def catmull_rom(keys: ArrayLike, times: ArrayLike, at: ArrayLike, method: Method = "dlb") -> Blended[Any]:
    """Blend form: the keys blended by `method` with the weights of the spline (Smith 2013, section 3.2.2).

    Rigid for every method except matrix_linear. keys: in the layout of the method.

    If keys are more than about 100 degrees apart, the negative weights may keep the iterations of qv_slerp
    and dib from converging: the result is then not defined, finite, and may jump.
    """
    return Blended(*_native.catmull_rom(keys, times, at, method))


def catmull_rom_vector(keys: ArrayLike, times: ArrayLike, at: ArrayLike) -> Blended[Any]:
    """Vector form: the components as a vector of 12, 7, 8 or, for points, 3 numbers (Smith 2013, algorithm
    3).

    Rigid only at the keys; the layout's normalized() makes it rigid everywhere.
    """
    return Blended(*_native.catmull_rom_vector(keys, times, at))


def hermite(keys: ArrayLike, tangents: ArrayLike, times: ArrayLike, at: ArrayLike) -> Blended[Any]:
    """The cubic Hermite spline through keys with arbitrary tangents (Smith 2013, section 2.3.2).

    keys: [n, 3], points, or [n, 8], rigid transforms.
    tangents: for a unit of time. Of points [n, 3]. Of transforms [n, 6], twists in each key's own axes:
        after a short time h the curve is compose(key, from_twist(h * tangent)).

    For transforms it is a Bezier curve whose chords are screws (Shoemake 1985, for quaternions): rigid
    throughout. Not defined where "sclerp" is not defined between two of its control poses.
    """
    return Blended(*_native.hermite(keys, tangents, times, at))
