# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning in native code: bind a mesh to bones once, deform it at any pose. Numpy in, numpy out.

Rigid transforms, and what lies between them: sinew.affine, sinew.quat_vec, sinew.dual_quat,
sinew.interpolate, sinew.spline; their parts: sinew.quat, sinew.dual; and what fits them to measurements:
sinew.fit. Rotations that bring bones to where they are wanted: sinew.ik.
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
