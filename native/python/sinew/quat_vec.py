# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms as quaternion-vector pairs (QV; Smith 2013, section 2.2.1).

Layout: [.., 7] as (w, x, y, z, tx, ty, tz), with a quaternion of unit length: rotation, then translation.

All functions accept one transform or many: leading axes broadcast as in numpy, and numbers may be used
instead of arrays of numbers. Arrays may be anything that numpy converts to one. The result is float32 if all
arrays in a call are float32 or smaller, float64 otherwise, as numpy promotes; plain numbers do not count.
ValueError names the argument, what was expected and what was given; NaN and infinity are refused.
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
