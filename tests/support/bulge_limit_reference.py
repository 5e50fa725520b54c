# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage bulge_limit in float64 numpy, from Kim and Han 2014 and its definition, as the golden set has it,
for any mesh and options: the oracle for the library."""

import numpy as np
from reference import stages


def limit(  # noqa: PLR0913 - as the library's
    points,
    rest_points,
    offsets,
    bones,
    weights,
    heads,
    tails,
    transforms,
    strength=1.0,
    form="continuous",
    mask=None,
):
    """The limited points, float64 [vertices, 3]. All arguments are in the space of the bones."""
    of_bones = stages.as_limits(*(np.asarray(each, np.float64) for each in (heads, tails, transforms)))
    result = np.asarray(points, np.float64).copy()
    for vertex, rest in enumerate(np.asarray(rest_points, np.float64)):
        span = slice(offsets[vertex], offsets[vertex + 1])
        of, share = bones[span], np.asarray(weights[span], np.float64)
        of, share = of[share > 0.0], share[share > 0.0]
        amount = strength * (1.0 if mask is None else np.clip(mask[vertex], 0.0, 1.0))
        result[vertex] = stages.limited(result[vertex], rest, of, share / share.sum(), of_bones, amount, form)
    return result
