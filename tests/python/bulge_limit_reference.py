# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage bulge_limit in float64 numpy, from Kim and Han 2014 and its definition: the oracle for the
library."""

import numpy as np


def nearest(head, tail, point):
    """The point of the segment nearest to `point`: an end, or the foot of the perpendicular."""
    along = tail - head
    length = np.linalg.norm(along)
    if length == 0.0:
        return head
    direction = along / length
    foot = head + direction * (direction @ (point - head))
    candidates = [head, tail]
    if 0.0 <= direction @ (point - head) <= length:
        candidates.append(foot)
    return min(candidates, key=lambda candidate: np.linalg.norm(point - candidate))


def stretch(linear, head, tail):
    """The largest singular value of the motion on directions perpendicular to the bone, without the
    component along the posed bone; for a point the root mean square of all."""
    axis = tail - head
    if not axis.any():
        return np.linalg.norm(linear) / np.sqrt(3.0)
    axis = axis / np.linalg.norm(axis)
    image = linear @ axis
    across = np.eye(3) - np.outer(image, image) / (image @ image) if image.any() else np.eye(3)
    return np.linalg.svd(across @ linear @ (np.eye(3) - np.outer(axis, axis)))[1][0]


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
    transforms = np.asarray(transforms, np.float64)
    heads, tails = np.asarray(heads, np.float64), np.asarray(tails, np.float64)
    posed_heads, posed_tails = (
        np.einsum("bij,bj->bi", transforms[:, :3, :3], ends) + transforms[:, :3, 3] for ends in (heads, tails)
    )
    stretches = [stretch(m[:3, :3], h, t) for m, h, t in zip(transforms, heads, tails, strict=True)]
    result = np.asarray(points, np.float64).copy()
    for vertex, x in enumerate(result):
        span = slice(offsets[vertex], offsets[vertex + 1])
        of, share = bones[span], np.asarray(weights[span], np.float64)
        of, share = of[share > 0.0], share[share > 0.0]
        if len(of) < 2:
            continue
        share = share / share.sum()
        if form == "kim_han":
            of, share = of[[share.argmax()]], np.ones(1)
        rest = np.asarray(rest_points[vertex], np.float64)
        apart = [np.linalg.norm(rest - nearest(heads[b], tails[b], rest)) for b in of]
        allowed = (share @ apart) * (share @ [stretches[b] for b in of])
        centre = share @ [nearest(posed_heads[b], posed_tails[b], x) for b in of]
        distance = np.linalg.norm(x - centre)
        if distance > allowed:
            amount = strength * (1.0 if mask is None else np.clip(mask[vertex], 0.0, 1.0))
            result[vertex] = x + amount * (1.0 - allowed / distance) * (centre - x)
    return result
