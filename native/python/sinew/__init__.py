# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning in native code: bind a mesh to bones once, then deform it for any pose. Numpy in, numpy out.

sinew.affine, sinew.quat_vec and sinew.dual_quat have rigid transforms; sinew.quat and sinew.dual have their
parts; sinew.interpolate and sinew.spline interpolate them; sinew.fit fits them to measurements; sinew.ik has
inverse kinematics.
"""

from . import affine, dual, dual_quat, fit, ik, interpolate, quat, quat_vec, spline
from ._native import (
    Binding,
    BulgeLimit,
    Deformer,
    DeltaMush,
    Method,
    Normals,
    Parameter,
    Skeleton,
    SkinnedNormals,
    Stage,
    __version__,
    centres_of_rotation,
    direct_delta_mush,
    keep_thread_state,
    methods,
    stages,
)

__all__ = [
    "Binding",
    "BulgeLimit",
    "Deformer",
    "DeltaMush",
    "Method",
    "Normals",
    "Parameter",
    "Skeleton",
    "SkinnedNormals",
    "Stage",
    "__version__",
    "affine",
    "centres_of_rotation",
    "direct_delta_mush",
    "dual",
    "dual_quat",
    "fit",
    "ik",
    "interpolate",
    "keep_thread_state",
    "methods",
    "quat",
    "quat_vec",
    "spline",
    "stages",
]
