from __future__ import annotations
import numpy.typing
import sinew._types
import typing
__all__: list[str] = ['average', 'hand_eye', 'rigid']
def average(poses: numpy.typing.ArrayLike, weights: numpy.typing.ArrayLike | None = None, *, robust: bool = False) -> sinew._types.Averaged[typing.Any]:
    """The mean of n poses, in their layout. Signs of quaternions and the order do not matter.

    poses: [.., n, 4, 4], [.., n, 3, 4], [.., n, 7] or [.., n, 8], n >= 1. A matrix's linear part is replaced by
        the nearest rotation.
    weights: [.., n], not negative; None: 1 each.
    robust: weight each pose by Tukey's biweight of its angle and of its distance from the mean, which decreases
        with both and is 0 from 3.5 times their medians on (Beaton and Tukey 1974): almost half of the weight may
        be outliers. `kept` says how much each pose counts. Distances are those between images of the origin, so
        the origin should be within what moves.

    Without `robust`, the pose relative to which the weighted screws to all poses sum to 0, as for "dib" of
    sinew.interpolate (Kavan et al. 2008, algorithm 3). The iteration starts at the mean of the rotation matrices
    (Markley et al. 2007). The result does not depend on the origin or on the unit of length. Not defined: several
    equally good means, such as for rotations by 0, 120 and 240 degrees about one axis; a pose 180 degrees from
    the result; no positive weight (the identity). With `robust`, also not defined if the poses that count do not
    have more than half of the weight, or are not all within 90 degrees of the result.
    """
def hand_eye(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike, weights: numpy.typing.ArrayLike | None = None) -> sinew._types.HandEye[typing.Any]:
    """Solves a x = x b for x: the pose of one of two bodies that are fixed to each other, seen from the
    other.

    a, b: [.., n, 4, 4], [.., n, 3, 4], [.., n, 7] or [.., n, 8], in one layout, which the result has as well: n
        motions of the one body and the same motions of the other, in one unit of length, such as of a robot's
        hand and of the camera on it, or of a bone and of a marker. A matrix's linear part is replaced by the
        nearest rotation.
    weights: [.., n], not negative; None: 1 each.

    Uses dual quaternions, which give rotation and translation at once (Daniilidis 1999). Then solves for the
    translation again, by least squares for that rotation (Park, Martin 1994), which is less sensitive to noise.
    Not defined: fewer than two motions, rotations only about parallel axes, only rotations by 180 degrees, no
    positive weight.
    """
def rigid(source: numpy.typing.ArrayLike, target: numpy.typing.ArrayLike, weights: numpy.typing.ArrayLike | None = None, *, source_directions: numpy.typing.ArrayLike | None = None, target_directions: numpy.typing.ArrayLike | None = None, direction_weights: numpy.typing.ArrayLike | None = None) -> sinew._types.RigidFit[typing.Any]:
    """The rigid transform that maps `source` to `target` with the smallest weighted sum of squared
    distances.

    source, target: [.., n, 3], points. n may be 0 if there are directions; the translation is then 0.
    weights: [.., n], not negative; None: 1 each.
    source_directions, target_directions: [.., m, 3], or None. Any length, which is ignored; a pair in which
        either has length 0 does not count.
    direction_weights: [.., m], not negative; None: 1 each. A direction counts as a point at distance 1 from the
        middle, so its weight is in squares of lengths.

    The result is in the layout of sinew.quat_vec. Its rotation is an eigenvector of a 4x4 matrix (Horn 1987).

    Not defined: points on one line or all in one position, a mirror image with a symmetry, no positive weight
    (the identity). For points in a plane the fit is defined. is_mirrored: a mirror image would fit better; the
    result is still the best rotation.
    """
