# SPDX-License-Identifier: GPL-3.0-or-later
"""Splines through transforms or points at given times (Catmull and Rom 1974; Smith 2013, section 2.3.2).

keys   [n, 4, 4], [n, 3, 4], [n, 7] or [n, 8], n >= 1, rotations of unit length; or [n, 3], points, for
       catmull_rom_vector()
times  [n], non-decreasing. The curve is constant before the first time and after the last. Keys of equal
       time are a cut: the curve ends at the first of them and starts again at the last
at     [..] or a number: the times at which to evaluate the curve

For Catmull-Rom splines the tangent at an inner key is (next - previous) / (difference of their times),
scaled to each interval; at an end it has the direction of the straight line to the next key. Signs of
quaternions are chosen along the chain of keys, so that adjacent keys are in one hemisphere.

Not defined if keys in use are 180 degrees apart (quaternions; the signs as given then decide), or if the
blend is not defined (sinew.interpolate).
"""

from ._native.spline import catmull_rom, catmull_rom_vector
from ._types import Blended

__all__ = ["Blended", "catmull_rom", "catmull_rom_vector"]
