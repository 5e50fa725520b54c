# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms as unit dual quaternions real + e dual (DQ; Smith 2013, section 2.2.3).

Layout: [.., 8] as (w, x, y, z) of the real part, then of the dual part. Unit means |real| = 1 and dot(real,
dual) = 0. a and -a are the same transform.
"""

from ._native.dual_quat import *
