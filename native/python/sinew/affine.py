# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms as 3x4 matrices, x -> linear x + translation.

Layout: [.., 4, 4] or [.., 3, 4], row-major, column vectors. A fourth row is not read; results have one. The
linear part may scale, shear and mirror. Functions that take a rigid transform raise ValueError where it does;
normalized() makes it rigid.
"""

from ._native.affine import *
