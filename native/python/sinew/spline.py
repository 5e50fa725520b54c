# SPDX-License-Identifier: GPL-3.0-or-later
"""Splines through transforms or points at given times (Catmull and Rom 1974; Smith 2013, section 2.3.2).

keys   [n, 4, 4], [n, 3, 4], [n, 7] or [n, 8], n >= 1, rotations of unit length; [n, 3], points, for
       catmull_rom_vector() and hermite()
times  [n], not decreasing. Before the first the value is the first key, after the last the last. Keys of
       equal time are a cut: the curve ends at the first of them and begins anew at the last
at     [..] or a number: the times wanted

Of Catmull-Rom splines the tangent at an inner key is (next - previous) / (their times' difference), scaled to
each interval; at an end that of the straight way to the neighbour. Quaternions are brought to one side along
the chain of keys.

Not defined where keys in use are half a turn apart (quaternions; the signs as given decide), and where the
blend is not (sinew.interpolate). ValueError names the argument, what was wanted and what came.
"""

from typing import Any

from numpy.typing import ArrayLike

from ._native import spline as _native
from ._types import Blended
from .interpolate import Method

__all__ = ["Blended", "catmull_rom", "catmull_rom_vector", "hermite"]


def catmull_rom(keys: ArrayLike, times: ArrayLike, at: ArrayLike, method: Method = "dlb") -> Blended[Any]:
    """Blend form: the keys blended by `method` with the weights of the spline (Smith 2013, section 3.2.2).

    Rigid for every method but matrix_linear. keys: in the layout of the method.

    With keys more than about 100 degrees apart the negative weights keep the iterations of qv_slerp and dib
    from settling here and there: not defined, finite, and likely to jump.
    """
    return Blended(*_native.catmull_rom(keys, times, at, method))


def catmull_rom_vector(keys: ArrayLike, times: ArrayLike, at: ArrayLike) -> Blended[Any]:
    """Vector form: the components as a vector of 12, 7, 8 or, of points, 3 numbers (Smith 2013, algorithm 3).

    Rigid at the keys only; the layout's normalized() makes it so everywhere.
    """
    return Blended(*_native.catmull_rom_vector(keys, times, at))


def hermite(keys: ArrayLike, tangents: ArrayLike, times: ArrayLike, at: ArrayLike) -> Blended[Any]:
    """The cubic Hermite spline: through keys, with tangents of any choice (Smith 2013, section 2.3.2).

    keys: [n, 3], points, or [n, 8], rigid transforms.
    tangents: for a unit of time. Of points [n, 3]. Of transforms [n, 6], twists in each key's own axes:
        after a short time h the curve is compose(key, from_twist(h * tangent)).

    Of transforms it is a Bezier curve whose chords are screws (Shoemake 1985, of quaternions): rigid
    throughout. Not defined where "sclerp" is not between two of its control poses.
    """
    return Blended(*_native.hermite(keys, tangents, times, at))
