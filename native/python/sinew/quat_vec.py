# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms as quaternion-vector pairs (QV; Smith 2013, section 2.2.1).

Layout: [.., 7] as (w, x, y, z, tx, ty, tz), with a quaternion of unit length: rotation, then translation.
"""

from ._native.quat_vec import *
