# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses of bones relative to rest, without Blender."""

from typing import NamedTuple

import numpy as np


class Poses(NamedTuple):
    """Bones' transforms: rigid [.., 7] in the layout of sinew.quat_vec, unit; scale [.., 3]; float64."""

    rigid: np.ndarray
    scale: np.ndarray
