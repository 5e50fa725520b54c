# SPDX-License-Identifier: GPL-3.0-or-later
"""Types that the typed modules share."""

from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Float = TypeVar("Float", np.float32, np.float64)


class Screw(NamedTuple, Generic[Float]):
    """axis and moment [.., 3]; angle (radians), translation along the axis and pitch [..]."""

    axis: NDArray[Float]
    moment: NDArray[Float]
    angle: NDArray[Float]
    translation: NDArray[Float]
    pitch: NDArray[Float]


class Distance(NamedTuple, Generic[Float]):
    """angle (radians) and translation (length), [..]."""

    angle: NDArray[Float]
    translation: NDArray[Float]


class ScaleSplit(NamedTuple, Generic[Float]):
    """rigid and scale [.., 4, 4]; has_scale bool [..]: whether `scale` differs from the identity by more
    than rounding."""

    rigid: NDArray[Float]
    scale: NDArray[Float]
    has_scale: NDArray[np.bool_] | Any


class Blended(NamedTuple, Generic[Float]):
    """The transforms, and whether each is defined; the methods specify the result where it is not."""

    transforms: NDArray[Float]
    is_defined: NDArray[np.bool_] | Any
