# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the report's cubic Hermite spline, compared with 50 digits as tests/python/library/test_exact.py
does."""

import functools
import itertools

import exact as e
import numpy as np
from exact import exact, rounded
from exact_cases import FLOATS, agree, agree_motions, in_layout, largest, points, translations
from exact_interpolation import CURVES, KEYS, TIMES, by_curve, interval, spline_cases
from future_work.curves import hermite


@functools.cache
def hermite_terms():
    """Indices [COUNT, 2], the part of the interval and its length, numbers [COUNT]."""
    _cases, times, at = spline_cases()
    found = [interval(times[curve], moment) for curve in range(CURVES) for moment in at[curve]]
    keys, after, part, span = (np.array(column) for column in zip(*found, strict=True))
    first = np.repeat(np.arange(CURVES) * KEYS, TIMES)
    return np.stack([first + keys, first + after], axis=1), part, span


def test_through_points():
    ends, u, span = hermite_terms()
    keys, tangents = points(105)[: CURVES * KEYS], points(106)[: CURVES * KEYS]
    p, q = exact(keys[ends[:, 0]]), exact(keys[ends[:, 1]])
    leave, arrive = exact(tangents[ends[:, 0]]) * span, exact(tangents[ends[:, 1]]) * span
    # Smith 2013, section 2.3.2, in powers of u.
    want = rounded(
        (2 * u**3 - 3 * u**2 + 1) * p
        + (u**3 - 2 * u**2 + u) * leave
        + (3 * u**2 - 2 * u**3) * q
        + (u**3 - u**2) * arrive
    )
    size = largest(keys[ends]) + largest(tangents[ends]) * span.astype(np.float64)
    for dtype in FLOATS:
        got, is_defined = by_curve(hermite, dtype, keys, tangents)
        assert is_defined.all()
        agree(got, want, size)


def test_through_motions():
    cases = spline_cases()[0]
    ends, u, span = hermite_terms()
    rng = np.random.default_rng(107)
    count = CURVES * KEYS
    tangents = np.column_stack([0.2 * rng.normal(size=(count, 3)), translations(rng, count)])
    third = span / 3

    def velocity(end, factor):
        v = exact(tangents[ends[:, end]])
        return e.from_twist(v[:3] * factor, v[3:] * factor)

    first, last = cases.exact.take(ends[:, 0]), cases.exact.take(ends[:, 1])
    points_of_curve = [
        first,
        e.compose(first, velocity(0, third)),
        e.compose(last, velocity(1, -third)),
        last,
    ]
    while len(points_of_curve) > 1:
        points_of_curve = [
            e.compose(a, e.power(e.compose(e.inverse(a), b), u))
            for a, b in itertools.pairwise(points_of_curve)
        ]
    want = in_layout(points_of_curve[0], "dual_quat")
    size = largest(cases.size[ends]) + largest(tangents[ends][..., 3:]) * span.astype(np.float64)
    for dtype in FLOATS:
        got, is_defined = by_curve(hermite, dtype, cases.dual_quat, tangents)
        assert is_defined.all()
        agree_motions(got, "dual_quat", want, size)
