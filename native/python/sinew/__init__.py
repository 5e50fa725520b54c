# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning in native code: bind a mesh to bones once, then deform it for any pose. Numpy in, numpy out.

sinew.affine, sinew.quat_vec and sinew.dual_quat have rigid transforms; sinew.quat and sinew.dual have their
parts; sinew.interpolate and sinew.spline interpolate them.

An array is described by its type and, in brackets, the length of each axis: float32 [vertices, 3]. An
argument may be anything that numpy converts to such an array without losing more than digits of fractions:
lists, float64, int64 whose numbers fit. Constructors copy their arguments. An array `out` has the shape of
the result, is written in place and returned; it is C-contiguous, aligned, and never converted.

[..] are any number of leading axes, which broadcast as in numpy. A number may be used instead of an array of
numbers [..]. Functions of such arrays return float32 if all arrays in a call are float32 or smaller, float64
otherwise, as numpy promotes; plain numbers do not count. NaN and infinity are refused.

`threads` is how many threads a call may use at most; None or 0: as many as useful. The result is the same bit
for bit. Calls that take long release the GIL.

Errors say which argument is wrong, what was expected and what was given: ValueError, or TypeError for a name
that is no str.
"""

from . import affine, dual, dual_quat, interpolate, quat, quat_vec, spline
from ._native import *
from ._native import __version__ as __version__

__all__ = [name for name in dir() if not name.startswith("_")]
