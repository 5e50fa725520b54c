# SPDX-License-Identifier: GPL-3.0-or-later
"""Catmull-Rom splines through transforms at given times (Catmull and Rom 1974; Smith 2013, section 2.3.2).

keys   [n, 4, 4], [n, 3, 4], [n, 7] or [n, 8], n >= 1, rotations of unit length
times  [n], not decreasing. Before the first the value is the first key, after the last the last. Keys of
       equal time are a cut: the curve ends at the first of them and begins anew at the last
at     [..] or a number: the times wanted

The tangent at an inner key is (next - previous) / (their times' difference), scaled to each interval; at an
end that of the straight way to the neighbour. Quaternions are brought to one side along the chain of keys.

Not defined where keys in use are half a turn apart (quaternions; the signs as given decide), and where the
blend is not (sinew.interpolate). ValueError names the argument, what was wanted and what came.
"""

from typing import Any

from numpy.typing import ArrayLike

from ._native import spline as _native
from ._types import Blended
from .interpolate import Method

__all__ = ["Blended", "catmull_rom", "catmull_rom_vector"]


def catmull_rom(keys: ArrayLike, times: ArrayLike, at: ArrayLike, method: Method = "dlb") -> Blended[Any]:
    """Blend form: the keys blended by `method` with the weights of the spline (Smith 2013, section 3.2.2).

    Rigid for every method but matrix_linear. keys: in the layout of the method.

    With keys more than about 100 degrees apart the negative weights keep the iterations of qv_slerp and dib
    from settling here and there: not defined, finite, and likely to jump.
    """
    return Blended(*_native.catmull_rom(keys, times, at, method))


def catmull_rom_vector(keys: ArrayLike, times: ArrayLike, at: ArrayLike) -> Blended[Any]:
    """Vector form: the components as a vector of 12, 7 or 8 numbers (Smith 2013, algorithm 3).

    Rigid at the keys only; the layout's normalized() makes it so everywhere.
    """
    return Blended(*_native.catmull_rom_vector(keys, times, at))
