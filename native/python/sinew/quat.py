# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations as unit quaternions w + xi + yj + zk (Smith 2013, section 2.1).

Layout: [.., 4] as (w, x, y, z). q and -q are the same rotation. sinew.quat_vec adds a translation.
"""

from ._native.quat import *
