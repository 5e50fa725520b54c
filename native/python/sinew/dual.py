# SPDX-License-Identifier: GPL-3.0-or-later
"""Dual numbers real + e dual, e^2 = 0 (Clifford 1873; Smith 2013, section 2.2.3).

Layout: [.., 2] as (real, dual). Sums and differences are those of the arrays. A function of a dual number is
f(real) + e dual f'(real), so with dual = 1 the dual part is the derivative.
"""

from ._native.dual import *
