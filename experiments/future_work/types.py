# SPDX-License-Identifier: GPL-3.0-or-later
"""What curves, fits and solvers return."""

from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from sinew._types import Blended as Blended

Float = TypeVar("Float", np.float32, np.float64)


class RigidFit(NamedTuple, Generic[Float]):
    """transforms: target_from_source, in the layout of sinew.quat_vec; error [..]: the root of the weighted
    mean of the remaining squared distances; is_defined, is_mirrored: bool [..]."""

    transforms: NDArray[Float]
    error: NDArray[Float]
    is_defined: NDArray[np.bool_] | Any
    is_mirrored: NDArray[np.bool_] | Any


class HandEye(NamedTuple, Generic[Float]):
    """transforms: x; angle (radians) and translation [..]: roots of the weighted means of the squared
    differences of a x and x b; is_defined: bool [..]."""

    transforms: NDArray[Float]
    angle: NDArray[Float]
    translation: NDArray[Float]
    is_defined: NDArray[np.bool_] | Any


class Averaged(NamedTuple, Generic[Float]):
    """transforms: the means; is_defined: bool [..]; kept [.., n]: how much each pose counts besides its
    weight, 0 to 1; always 1 if the mean is not robust."""

    transforms: NDArray[Float]
    is_defined: NDArray[np.bool_] | Any
    kept: NDArray[Float]


class Solution(NamedTuple):
    """rotations [.., bones, 4]: relative to rest, w >= 0; distance and angle (radians) [..]: the largest
    remaining errors of a tip's position and rotation; iterations [..], int32; is_reached [..]: whether
    both are within the tolerance."""

    rotations: NDArray[np.float64]
    distance: NDArray[np.float64] | Any
    angle: NDArray[np.float64] | Any
    iterations: NDArray[np.int32] | Any
    is_reached: NDArray[np.bool_] | Any
