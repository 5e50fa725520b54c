# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations and rigid motions with 50 digits: the oracle for test_exact.py.

Numbers are Python's decimals, whose sums and products take a tenth of the time of mpmath's; sines, cosines
and arctangents are mpmath's. Arrays have components first: a quaternion is [4, n], a vector [3, n], a matrix
[3, 3, n]. Written from the definitions, with other formulas than the library's where there are any; with 50
digits, cancellation does not matter.
"""

import decimal
from decimal import Decimal
from typing import NamedTuple

import mpmath
import numpy as np

DIGITS = 50
# mpmath's results keep their digits if they are converted by way of decimal text.
mpmath.mp.dps = DIGITS + 5
decimal.getcontext().prec = DIGITS


def _by_mpmath(function, arguments):
    def of(*numbers):
        return Decimal(mpmath.nstr(function(*(mpmath.mpf(str(number)) for number in numbers)), DIGITS + 2))

    return np.frompyfunc(of, arguments, 1)


# The number with 50 digits that is nearest to a float.
number = np.frompyfunc(lambda value: +Decimal(value), 1, 1)
sqrt = np.frompyfunc(Decimal.sqrt, 1, 1)
exp = np.frompyfunc(Decimal.exp, 1, 1)
log = np.frompyfunc(Decimal.ln, 1, 1)
sin, cos = _by_mpmath(mpmath.sin, 1), _by_mpmath(mpmath.cos, 1)
atan2 = _by_mpmath(mpmath.atan2, 2)
ONE, HALF = Decimal(1), Decimal("0.5")


class Motion(NamedTuple):
    """x -> q x q* + t. q: [4, n], unit; t: [3, n]."""

    q: np.ndarray
    t: np.ndarray

    def take(self, index):
        """The motions with index `index` among the cases."""
        return Motion(self.q[:, index], self.t[:, index])


def exact(array):
    """Floats [.., k] as numbers [k, ..]."""
    return number(np.moveaxis(np.asarray(array, np.float64), -1, 0))


def rounded(components):
    """Numbers [k, ..] as float64 [.., k]."""
    return np.moveaxis(components, 0, -1).astype(np.float64)


def dot(a, b):
    return (a * b).sum(axis=0)


def length(v):
    return sqrt(dot(v, v))


def unit(v):
    """`v` normalised; unchanged if its length is 0."""
    size = length(v)
    return v / np.where(size > 0, size, ONE)


def cross(a, b):
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dtype=object
    )


# --- Quaternions


def product(p, q):
    """Hamilton's product."""
    a, b, c, d = p
    e, f, g, h = q
    return np.array(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ],
        dtype=object,
    )


def conjugate(q):
    return np.concatenate([q[:1], -q[1:]])


def pure(v):
    return np.concatenate([v[:1] * 0, v])


def matrix(q):
    """[3, 3, n], by Rodrigues' formula: 1 + 2 w [v] + 2 [v]^2."""
    w, v = q[0], q[1:]
    square = dot(v, v)
    skew = hat(v)
    result = 2 * w * skew + 2 * v[:, None] * v[None]
    for i in range(3):
        result[i, i] += 1 - 2 * square
    return result


def hat(v):
    zero = v[0] * 0
    return np.array([[zero, -v[2], v[1]], [v[2], zero, -v[0]], [-v[1], v[0], zero]], dtype=object)


def times(m, v):
    """The products of the matrices `m` and the vectors `v`."""
    return np.array([dot(row, v) for row in m], dtype=object)


def matmul(a, b):
    return np.array([[dot(row, b[:, j]) for j in range(b.shape[1])] for row in a], dtype=object)


def determinant(m):
    return dot(m[:, 0], cross(m[:, 1], m[:, 2]))


def inverse_matrix(m):
    """The inverse, from cofactors."""
    a, b, c = m[:, 0], m[:, 1], m[:, 2]
    return np.array([cross(b, c), cross(c, a), cross(a, b)], dtype=object) / determinant(m)


def rotate(q, v):
    """q v q*, multiplied out: (w^2 - u^2) v + 2 (u v) u + 2 w u x v."""
    w, u = q[0], q[1:]
    return (w * w - dot(u, u)) * v + 2 * dot(u, v) * u + 2 * w * cross(u, v)


def from_axis_angle(axis, angle):
    """The quaternion of the rotation; the identity if the length of the axis is 0."""
    has_axis = length(axis) > 0
    half = np.where(has_axis, angle, angle * 0) * HALF
    return np.concatenate([cos(half)[None], sin(half) * unit(axis)])


def from_rotation_vector(v):
    return from_axis_angle(v, length(v))


def rotation_vector(q):
    """The rotation vector, 0 to pi long; at pi the sign of `q` decides."""
    near = np.where(q[0] < 0, -q, q)
    angle = 2 * atan2(length(near[1:]), near[0])
    return angle * unit(near[1:])


# --- Motions


def compose(a, b):
    return Motion(product(a.q, b.q), rotate(a.q, b.t) + a.t)


def inverse(a):
    return Motion(conjugate(a.q), -rotate(conjugate(a.q), a.t))


def dual_part(a):
    """The dual part, [4, n], of the unit dual quaternion: t q / 2."""
    return HALF * product(pure(a.t), a.q)


def of_dual(real, dual):
    """The motion of any dual quaternion with a nonzero real part: divided by its norm."""
    size = length(real)
    real, dual = real / size, dual / size
    dual = dual - real * dot(real, dual)
    return Motion(real, 2 * product(dual, conjugate(real))[1:])


def _coefficients(angle):
    """(1 - cos x) / x^2 and (x - sin x) / x^3; series where even 50 digits cancel."""
    is_small = angle < Decimal("1e-8")
    x = np.where(is_small, ONE, angle)
    square = angle * angle
    first = np.where(is_small, HALF - square / 24, (1 - cos(x)) / (x * x))
    second = np.where(is_small, ONE / 6 - square / 120, (x - sin(x)) / (x * x * x))
    return first, second


def from_twist(angular, linear):
    """The exponential: the translation is the integral of the rotation over unit time."""
    first, second = _coefficients(length(angular))
    sideways = cross(angular, linear)
    return Motion(
        from_rotation_vector(angular), linear + first * sideways + second * cross(angular, sideways)
    )


def to_twist(a):
    """The logarithm, (angular, linear): the linear part is the one that integrates to the translation."""
    angular = rotation_vector(a.q)
    angle = length(angular)
    is_small = angle < Decimal("1e-8")
    x = np.where(is_small, ONE, angle)
    series = ONE / 12 + angle * angle / 720
    factor = np.where(is_small, series, 1 / (x * x) - cos(x * HALF) / sin(x * HALF) / (2 * x))
    sideways = cross(angular, a.t)
    return angular, a.t - HALF * sideways + factor * cross(angular, sideways)


def power(a, exponent):
    angular, linear = to_twist(a)
    return from_twist(exponent * angular, exponent * linear)


def about(axis, point, angle, translation):
    """The rotation by `angle` about the line through `point` along `axis`, and `translation` along it."""
    q = from_axis_angle(axis, angle)
    return Motion(q, point - rotate(q, point) + translation * unit(axis))
