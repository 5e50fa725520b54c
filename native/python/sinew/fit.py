# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms fitted to what is measured: to points and directions, to motions, to many poses.

Every function takes one problem or many: axes before the last ones of each argument broadcast as numpy's do.
Arrays are anything that numpy makes one of. The result is float32 where all arrays of a call are of float32
or less, float64 otherwise; inside all is in float64. `is_defined` says whether the result is the only one
that is as good: where not, it is one of them, finite. ValueError names the argument, what was wanted and what
came; NaN, infinity and weights below 0 are refused.
"""

from typing import Any, Final, Literal

from numpy.typing import ArrayLike

from ._native import fit as _native
from ._types import Averaged, HandEye, RigidFit

__all__ = ["METHODS", "Averaged", "HandEye", "Method", "RigidFit", "average", "hand_eye", "rigid"]

Method = Literal["kabsch", "horn", "walker"]

METHODS: Final[tuple[Method, ...]] = _native.METHODS


def rigid(
    source: ArrayLike,
    target: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    source_directions: ArrayLike | None = None,
    target_directions: ArrayLike | None = None,
    direction_weights: ArrayLike | None = None,
    method: Method = "horn",
) -> RigidFit[Any]:
    """The rigid transform that takes `source` nearest to `target`: the least weighted sum of squared
    distances.

    source, target: [.., n, 3], points; n may be 0 where there are directions, and the translation is then 0.
    weights: [.., n], not below 0; None: 1 each.
    source_directions, target_directions: [.., m, 3], or None; of any length, of which only the direction
        counts. One of length 0 does not count.
    direction_weights: [.., m], not below 0; None: 1 each. A direction counts as a point at distance 1 from
        the middle, so its weight is in squares of lengths.
    method: one of METHODS. All have the same least squares and differ by rounding.

    kabsch  layout affine     by the singular values of the covariance (Kabsch 1976; Umeyama 1991)
    horn    layout quat_vec   by the eigenvector of a 4x4 matrix (Horn 1987)
    walker  layout dual_quat  rotation and translation at once (Walker, Shao, Volz 1991)

    Not defined: points on one line or all at one place, a mirror image with a symmetry, no weight above 0
    (the identity). Of points on a plane the fit is defined. is_mirrored: a mirror image would fit better; the
    result is the best rotation all the same.
    """
    return RigidFit(
        *_native.rigid(
            source, target, weights, source_directions, target_directions, direction_weights, method
        )
    )


def hand_eye(a: ArrayLike, b: ArrayLike, weights: ArrayLike | None = None) -> HandEye[Any]:
    """x of a x = x b: where one of two bodies that are fixed to each other is, seen from the other.

    a, b: [.., n, 4, 4], [.., n, 3, 4], [.., n, 7] or [.., n, 8], in one layout, that of the result: n motions
        of the one body and the same of the other, in one unit of length, such as of a robot's hand and of the
        camera on it, or of a bone and of a marker. A matrix's linear part becomes the nearest rotation.
    weights: [.., n], not below 0; None: 1 each.

    By dual quaternions, rotation and translation at once (Daniilidis 1999); then the translation again, by
    least squares for that rotation (Park, Martin 1994), which noise puts less far off. Not defined: fewer
    than two motions, rotations about parallel axes alone, half turns alone, no weight above 0.
    """
    return HandEye(*_native.hand_eye(a, b, weights))


def average(poses: ArrayLike, weights: ArrayLike | None = None, *, robust: bool = False) -> Averaged[Any]:
    """The mean of n poses, in their layout; signs of quaternions and the order do not matter.

    poses: [.., n, 4, 4], [.., n, 3, 4], [.., n, 7] or [.., n, 8], n >= 1. A matrix's linear part becomes the
        nearest rotation.
    weights: [.., n], not below 0; None: 1 each.
    robust: each pose counts the less the farther off it is, by Tukey's biweight of its angle and of its
        distance, and not at all from 3.5 times their medians on (Beaton and Tukey 1974): almost half of the
        weight may be wrong. `kept` says how much each counts. Distances are those of the origin's images, so
        that the origin should lie within what moves.

    Without `robust` it is where the weighted screws to the poses cancel, as "dib" of sinew.interpolate (Kavan
    et al. 2008, algorithm 3), begun at the mean of the rotation matrices (Markley et al. 2007): neither
    origin nor unit of length change it. Not defined: several means that are as good, as of rotations by 0,
    120 and 240 degrees about one axis; a pose 180 degrees from the result; no weight above 0 (the identity).
    Robust: where the poses that count have no more than half of the weight or are not all within 90 degrees
    of the result.
    """
    return Averaged(*_native.average(poses, weights, robust))
