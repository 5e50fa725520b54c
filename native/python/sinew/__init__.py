# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning in native code: bind a mesh to bones once, deform it at any pose. Numpy in, numpy out."""

from ._native import Deformer, Method, Skeleton, __version__, methods

__all__ = ["Deformer", "Method", "Skeleton", "__version__", "methods"]
