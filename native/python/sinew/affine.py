# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms as 3x4 matrices, x -> linear x + translation.

Layout: [.., 4, 4] or [.., 3, 4], row-major, column vectors. A fourth row is not read; results have one. The
linear part may scale and shear unless a function says otherwise.

All functions accept one transform or many: leading axes broadcast as in numpy, and numbers may be used
instead of arrays of numbers. Arrays may be anything that numpy converts to one. The result is float32 if all
arrays in a call are float32 or smaller, float64 otherwise, as numpy promotes; plain numbers do not count.
ValueError names the argument, what was expected and what was given; NaN and infinity are refused.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._native import affine as _native
from ._representation import Representation
from ._types import ScaleSplit

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
    "split_scale",
    "to_dual_quat",
    "to_quat_vec",
    "to_screw",
    "to_twist",
    "transform_normal",
    "transform_point",
    "transform_vector",
]

_layout = Representation(_native, np.eye(4))

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
to_dual_quat = _layout.to_dual_quat
to_quat_vec = _layout.to_quat_vec
to_screw = _layout.to_screw
to_twist = _layout.to_twist
transform_normal = _layout.transform_normal
transform_point = _layout.transform_point
transform_vector = _layout.transform_vector


def split_scale(posed_from_rest: ArrayLike, rest_bone: ArrayLike) -> ScaleSplit[Any]:
    """Splits a bone's motion into posed_from_rest = rigid * scale, as methods that blend rigid motions need
    it.

    posed_from_rest  maps points of the rest shape to the pose; may scale, shear and mirror
    rest_bone        the bone's rest axes (Y along the bone) and head in the same space; orthonormal

    Axes are made perpendicular while keeping Y, as Blender's Armature modifier does for Preserve Volume;
    mirroring becomes part of `scale`. For a motion within 1e-5 of orthonormal and 1e-4 of unit size, `scale`
    is the identity. `rigid` is a rotation and a translation even if axes vanish.
    """
    return ScaleSplit(*_native.split_scale(posed_from_rest, rest_bone))
