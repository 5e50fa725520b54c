# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms as 3x4 matrices, x -> linear x + translation.

Layout: [.., 4, 4] or [.., 3, 4], row-major, column vectors. A fourth row is not read; results have one. The
linear part may scale and shear unless a function says otherwise.
"""

from ._native.affine import *
