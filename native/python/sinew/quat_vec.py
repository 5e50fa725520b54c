# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms as quaternion-vector pairs (QV; Smith 2013, section 2.2.1).

Layout: [.., 7] as (w, x, y, z, tx, ty, tz), the quaternion of unit length: rotation, then translation.

Every function takes one or many: leading axes broadcast as numpy's do, and numbers may stand for arrays of
numbers. Arrays are anything that numpy makes one of. The result is float32 where all arrays of a call are of
float32 or less, float64 otherwise, as numpy promotes; numbers do not count. ValueError names the argument,
what was wanted and what came; NaN and infinity are refused.
"""

import numpy as np

from ._native import quat_vec as _native
from ._representation import Representation

__all__ = [
    "compose",
    "from_axis_angle",
    "from_rotation_matrix",
    "from_screw",
    "from_screw_about",
    "from_translation",
    "from_twist",
    "identity",
    "inverse",
    "normalized",
    "rigid_distance",
    "to_affine",
    "to_dual_quat",
    "to_screw",
    "to_twist",
    "transform_normal",
    "transform_point",
    "transform_vector",
]

_layout = Representation(_native, np.eye(1, 7)[0])

compose = _layout.compose
from_axis_angle = _layout.from_axis_angle
from_rotation_matrix = _layout.from_rotation_matrix
from_screw = _layout.from_screw
from_screw_about = _layout.from_screw_about
from_translation = _layout.from_translation
from_twist = _layout.from_twist
identity = _layout.identity
inverse = _layout.inverse
normalized = _layout.normalized
rigid_distance = _layout.rigid_distance
to_affine = _layout.to_affine
to_dual_quat = _layout.to_dual_quat
to_screw = _layout.to_screw
to_twist = _layout.to_twist
transform_normal = _layout.transform_normal
transform_point = _layout.transform_point
transform_vector = _layout.transform_vector
