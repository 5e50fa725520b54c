# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks with 50 digits: sinew.affine, sinew.quat_vec, sinew.dual_quat, sinew.quat, sinew.dual."""

import functools

import exact as e
import numpy as np
from exact import Motion, exact, rounded
from exact_cases import (
    COUNT,
    FLOATS,
    LAYOUTS,
    agree,
    agree_motions,
    angles,
    cases_of,
    directions,
    exact_matrix,
    in_layout,
    linear_maps,
    motions,
    nearest_rotations,
    pairs,
    points,
    step_of,
    translations,
)

# Functions that make a motion from numbers have one oracle for all three layouts: the motion, from this
# function.


def wanted(of):
    """`of`() returns (arguments, motion, size of what is summed, what errors of rotations are relative
    to)."""
    of = functools.cache(of)

    def check(name, function):
        arguments, motion, size, rotation = of()
        agree_all_motions(name, function, arguments, in_layout(motion, name), size, rotation=rotation)

    return check


def lengths(v):
    return np.linalg.norm(v, axis=-1)


def agree_all(function, arguments, want, size, **options):
    """In each type of numbers."""
    for dtype in FLOATS:
        agree(function(*(argument.astype(dtype) for argument in arguments)), want, size, **options)


def agree_all_motions(name, function, arguments, want, size, **options):
    for dtype in FLOATS:
        got = function(*(argument.astype(dtype) for argument in arguments))
        agree_motions(got, name, want, size, **options)


def values(of):
    """`of`() returns (arguments, result, what errors are relative to)."""
    return lambda _name, function: agree_all(function, *of())


@wanted
def from_axis_angle():
    rng = np.random.default_rng(20)
    axis = directions(rng) * (10.0 ** rng.uniform(-20, 15, COUNT) * (np.arange(COUNT) % 50 != 0))[:, None]
    angle = angles(rng) * rng.choice([-7.0, -1.0, 1.0, 3.0], COUNT)
    q = e.from_axis_angle(exact(axis), e.number(angle))
    return (axis, angle), Motion(q, q[1:] * 0), 0.0, 1.0 + np.abs(angle)


@wanted
def from_translation():
    t = points(21)
    return (t,), Motion(exact(np.tile([1.0, 0, 0, 0], (COUNT, 1))), exact(t)), lengths(t), 0.0


@wanted
def from_screw():
    rng = np.random.default_rng(22)
    axis = directions(rng) * (10.0 ** rng.uniform(-3, 3, COUNT))[:, None]
    point, along = translations(rng), translations(rng)[::-1, 0] * rng.choice([0.0, 1.0], COUNT)
    angle = angles(rng) * rng.choice([-2.0, 1.0], COUNT)
    # A component along the axis, which must be ignored.
    moment = np.cross(point, axis) + 0.5 * axis
    line = exact(axis) / e.length(exact(axis))
    foot = e.cross(line, exact(moment) / e.length(exact(axis)))
    motion = e.about(line, foot, e.number(angle), e.number(along))
    # Includes the component along the axis, which is subtracted.
    size = lengths(moment) / lengths(axis) + np.abs(along)
    return (axis, moment, angle, along), motion, size * (1 + np.abs(angle)), 1.0 + np.abs(angle)


@wanted
def from_screw_about():
    rng = np.random.default_rng(23)
    axis = directions(rng) * (10.0 ** rng.uniform(-20, 15, COUNT))[:, None]
    point, along = translations(rng), translations(rng)[::-1, 0]
    angle = angles(rng) * rng.choice([-2.0, 1.0], COUNT)
    motion = e.about(exact(axis), exact(point), e.number(angle), e.number(along))
    size = lengths(point) + np.abs(along)
    return (axis, point, angle, along), motion, size * (1 + np.abs(angle)), 1.0 + np.abs(angle)


@functools.cache
def twists_to_exp():
    rng = np.random.default_rng(24)
    # Angles of any size: every fifth is more than 360 degrees.
    angle = angles(rng) * np.where(np.arange(COUNT) % 5 == 0, 10.0 ** rng.uniform(0, 5, COUNT), 1.0)
    angular, linear = directions(rng) * angle[:, None], translations(rng)
    motion = e.from_twist(exact(angular), exact(linear))
    size = lengths(linear)
    return (np.column_stack([angular, linear]),), motion, size * (1 + angle), 1.0 + angle


from_twist = wanted(twists_to_exp)


# --- Functions of one motion


def identity(name, function):
    for dtype in FLOATS:
        assert function(dtype).dtype == dtype
        p = points(1).astype(dtype)
        np.testing.assert_array_equal(LAYOUTS[name].transform_point(function(dtype), p), p)


def from_rotation_matrix(name, function):
    cases = motions(2)
    still = cases_of(Motion(cases.exact.q, cases.exact.t * 0))
    agree_all_motions(name, function, (cases.affine[:, :3, :3],), getattr(still, name), 0.0)
    if name == "affine":
        maps = linear_maps(2)
        np.testing.assert_array_equal(function(maps[:, :3, :3])[:, :3, :3], maps[:, :3, :3])


@functools.cache
def twists(seed):
    """float64 [n, 6] for both signs of the quaternions, since either is right at 180 degrees; and scalar
    parts."""
    motion = motions(seed).exact
    both = [np.concatenate(e.to_twist(m)) for m in (motion, _other_way(motion))]
    return *(rounded(twist) for twist in both), np.abs(motion.q[0].astype(np.float64))


def _other_way(motion):
    """The same if the quaternion's w is not 0; otherwise the rotation vector about the opposite axis."""
    is_half = np.abs(motion.q[0]) < 1e-5
    return Motion(np.where(is_half, _through_zero(motion.q), motion.q), motion.t)


def _through_zero(q):
    """Equal to `q` up to rounding, but with the other sign of w, so that the shorter way is the other
    one."""
    tiny = e.number("1e-40")
    w = np.where(q[0] < 0, tiny, -tiny)
    return np.concatenate([w[None], q[1:]])


def agree_twists(got, seed, size):
    """Compares rotation vectors to the last digits of their length; in either direction near 180 degrees."""
    one, other, w = twists(seed)
    dtype = got.dtype
    near = (w < 8 * step_of(dtype)) & (
        np.linalg.norm(got[:, :3] - one[:, :3], axis=1) > np.linalg.norm(got[:, :3] - other[:, :3], axis=1)
    )
    want = np.where(near[:, None], other, one)
    agree(got[:, :3], want[:, :3], lengths(want[:, :3]))
    agree(got[:, 3:], want[:, 3:], size)


def to_twist(name, function):
    cases = motions(3)
    for dtype in FLOATS:
        agree_twists(function(cases.of(name, dtype)), 3, cases.size)


def to_screw(name, function):
    cases = motions(4)
    one, other, w = twists(4)
    for dtype in FLOATS:
        screw = function(cases.of(name, dtype))
        angle = lengths(one[:, :3])
        flips = (w < 8 * step_of(dtype)) & (np.einsum("ni,ni->n", screw.axis, one[:, :3]) < 0)
        twist = np.where(flips[:, None], other, one)
        size = np.where(angle > 0, angle, 1.0)
        axis = twist[:, :3] / size[:, None]
        # A rotation by less counts as none, and the axis is that of the translation.
        turns = angle > 4 * step_of(dtype)
        agree(screw.angle, angle, angle, where=turns)
        agree(screw.axis, axis, 1.0, where=turns)
        along = np.einsum("ni,ni->n", axis, cases.affine[:, :3, 3])
        agree(screw.translation, along, cases.size, where=turns)
        agree(screw.moment, moments(twist), cases.size / np.minimum(size, 1.0), where=turns)
        pitch = np.divide(along, angle, out=np.zeros(COUNT), where=turns)
        agree(np.where(turns, screw.pitch, 0), pitch, cases.size / size, where=turns)
        still = ~turns & (cases.size > 0) & (angle < step_of(dtype) / 4)
        path = cases.affine[:, :3, 3]
        agree(screw.axis * screw.translation[:, None], path, cases.size, where=still)
        assert not screw.angle[still].any()
        assert not screw.moment[still].any()
        assert np.isposinf(screw.pitch[still]).all()


def moments(twist):
    """The cross product of the line's point nearest to the origin, w x v / w^2, and the axis: v / |w|
    without its component along the axis."""
    angular, linear = exact(twist[:, :3]), exact(twist[:, 3:])
    size = e.length(angular)
    size = np.where(size > 0, size, e.number(1))
    axis = angular / size
    return rounded((linear - axis * e.dot(axis, linear)) / size)


def to_layout(other):
    def check(name, function):
        cases = motions(5)
        agree_all_motions(other, function, (getattr(cases, name),), getattr(cases, other), cases.size)

    return check


def inverse(name, function):
    cases = motions(6)
    want = in_layout(e.inverse(cases.exact), name)
    agree_all_motions(name, function, (getattr(cases, name),), want, cases.size, signed=True)
    if name == "affine":
        inverse_of_any(function)


def inverse_of_any(function):
    maps = linear_maps(6)
    linear = exact_matrix(maps[:, :3, :3])
    inverted = e.inverse_matrix(linear)
    moved = rounded(-e.times(inverted, exact(maps[:, :3, 3])))
    inverted = np.moveaxis(inverted.astype(np.float64), -1, 0)
    # Rounding of the matrix is multiplied by its condition number.
    norm = np.linalg.norm(inverted, axis=(1, 2))
    condition = norm * np.linalg.norm(maps[:, :3, :3], axis=(1, 2))
    for dtype in FLOATS:
        got = function(maps.astype(dtype))
        agree(got[:, :3, :3], inverted, norm * condition)
        agree(got[:, :3, 3], moved, norm * condition * lengths(maps[:, :3, 3]))


def normalized(name, function):
    rng = np.random.default_rng(7)
    if name == "affine":
        affine_normalized(function)
        return
    cases = motions(7)
    by = 10.0 ** rng.uniform(-15, 15, COUNT)
    if name == "quat_vec":
        given = cases.quat_vec * np.where(np.arange(7) < 4, by[:, None], 1.0)
        agree_all_motions(name, function, (given,), cases.quat_vec, cases.size, signed=True)
        return
    # Includes dual quaternions that are not a multiple of a transform: with a component of `dual` along
    # `real`.
    along = translations(rng)[:, :1]
    given = (cases.dual_quat + np.column_stack([np.zeros((COUNT, 4)), along * cases.dual_quat[:, :4]])) * by[
        :, None
    ]
    want = in_layout(e.of_dual(exact(given[:, :4]), exact(given[:, 4:])), name)
    agree_all_motions(name, function, (given,), want, cases.size + np.abs(along[:, 0]), signed=True)


def affine_normalized(function):
    """By scipy, with singular values in float64: as exact as their differences allow, and the library
    must be as well."""
    maps = linear_maps(7)
    want, size, gap = nearest_rotations(maps)
    agree_all_motions("affine", function, (maps,), want, lengths(maps[:, :3, 3]), rotation=size / gap)


# --- Motions and points


def compose(name, function):
    a, b = motions(8), motions(9)
    want = in_layout(e.compose(a.exact, b.exact), name)
    given = getattr(a, name), getattr(b, name)
    agree_all_motions(name, function, given, want, a.size + b.size, signed=True)
    if name == "affine":
        first, second = linear_maps(8), linear_maps(9)
        linear = e.matmul(exact_matrix(first[:, :3, :3]), exact_matrix(second[:, :3, :3]))
        linear = np.moveaxis(linear.astype(np.float64), -1, 0)
        moved = exact_apply(first, second[:, :3, 3])
        size = np.linalg.norm(first[:, :3, :3], axis=(1, 2))
        for dtype in FLOATS:
            got = function(first.astype(dtype), second.astype(dtype))
            agree(got[:, :3, :3], linear, size * np.linalg.norm(second[:, :3, :3], axis=(1, 2)))
            agree(got[:, :3, 3], moved, size * lengths(second[:, :3, 3]) + lengths(first[:, :3, 3]))


def exact_apply(maps, vectors):
    moved = e.times(exact_matrix(maps[:, :3, :3]), exact(vectors)) + exact(maps[:, :3, 3])
    return rounded(moved)


def transform_point(name, function):
    cases, p = motions(10), points(10)
    want = rounded(e.times(e.matrix(cases.exact.q), exact(p)) + cases.exact.t)
    agree_all(function, (getattr(cases, name), p), want, cases.size + lengths(p))
    if name == "affine":
        maps = linear_maps(10)
        want = exact_apply(maps, p)
        size = np.linalg.norm(maps[:, :3, :3], axis=(1, 2)) * lengths(p) + lengths(maps[:, :3, 3])
        agree_all(function, (maps, p), want, size)


def transform_vector(name, function):
    cases, v = motions(11), points(11)
    want = rounded(e.times(e.matrix(cases.exact.q), exact(v)))
    agree_all(function, (getattr(cases, name), v), want, lengths(v))
    if name == "affine":
        maps = linear_maps(11)
        want = rounded(e.times(exact_matrix(maps[:, :3, :3]), exact(v)))
        agree_all(function, (maps, v), want, np.linalg.norm(maps[:, :3, :3], axis=(1, 2)) * lengths(v))


def transform_normal(name, function):
    cases, n = motions(12), points(12)
    want = rounded(e.times(e.matrix(cases.exact.q), e.unit(exact(n))))
    agree_all(function, (getattr(cases, name), n), want, 1.0)
    if name == "affine":
        maps = linear_maps(12)
        inverted = e.inverse_matrix(exact_matrix(maps[:, :3, :3]))
        want = rounded(e.unit(e.times(np.swapaxes(inverted, 0, 1), exact(n))))
        agree_all(function, (maps, n), want, np.linalg.cond(maps[:, :3, :3]))


def rigid_distance(name, function):
    a, b = pairs(13)
    angle, apart = exact_distance(a.exact, b.exact)
    for dtype in FLOATS:
        got = function(a.of(name, dtype), b.of(name, dtype))
        agree(got.angle, angle, 1.0)
        agree(got.translation, apart, a.size + b.size)


def exact_distance(a, b):
    """Angle and distance, float64 [n]."""
    step = e.product(e.conjugate(a.q), b.q)
    angle = 2 * e.atan2(e.length(step[1:]), np.abs(step[0]))
    return angle.astype(np.float64), e.length(b.t - a.t).astype(np.float64)


# --- Functions of matrices, and of dual quaternions


def split_scale(_name, function):
    rest = motions(14)
    maps = linear_maps(14)
    # Every fourth does not scale.
    maps[::4] = motions(15).affine[::4]
    linear, bone = exact_matrix(maps[:, :3, :3]), e.matrix(rest.exact.q)
    posed = e.matmul(linear, bone)
    y = e.unit(posed[:, 1])
    # Blender's choice of the second axis under shear.
    along = e.dot(y, posed[:, 0])
    by_x = posed[:, 0] - y * along
    by_z = e.cross(y, posed[:, 2])
    x = e.unit(np.where(along < 1, by_x, by_z))
    odd = (along >= 1) & (e.dot(posed[:, 0], posed[:, 2]) >= 1)
    clear = ~odd.astype(bool) & (np.abs(along - 1) > 1e-4).astype(bool)
    clear &= (np.abs(e.dot(posed[:, 0], posed[:, 2]) - 1) > 1e-4).astype(bool)
    axes = np.stack([x, y, e.cross(x, y)], axis=1)
    rotation = e.matmul(axes, np.swapaxes(bone, 0, 1))
    rotation = np.moveaxis(rotation.astype(np.float64), -1, 0)
    rotation[::4] = maps[::4, :3, :3]
    scaled = np.arange(COUNT) % 4 != 0
    clear |= ~scaled
    assert clear.mean() > 0.7
    head = rest.affine[:, :3, 3]
    condition = np.linalg.cond(maps[:, :3, :3])
    norm = np.linalg.norm(maps[:, :3, :3], axis=(1, 2))
    size = norm * (rest.size + lengths(maps[:, :3, 3]))
    for dtype in FLOATS:
        split = function(maps.astype(dtype), rest.of("affine", dtype))
        np.testing.assert_array_equal(split.has_scale, scaled)
        agree(split.rigid[:, :3, :3], rotation, condition, where=clear)
        # Together they are the input, and the scale does not move the bone's head.
        both = exact_matrix(split.rigid[:, :3, :3].astype(np.float64))
        whole = e.matmul(both, exact_matrix(split.scale[:, :3, :3].astype(np.float64)))
        agree(np.moveaxis(whole.astype(np.float64), -1, 0).astype(dtype), maps[:, :3, :3], norm * condition)
        agree(exact_apply(split.scale, head).astype(dtype), head, (condition * (size + norm))[:])
        moved = exact_apply(maps, head)
        agree(exact_apply(split.rigid, head).astype(dtype), moved, condition * (size + norm))


def signs(*of):
    def check(_name, function):
        cases = motions(16)
        given = cases.dual_quat[:, : len(of)]
        np.testing.assert_array_equal(function(given), given * np.array(of))

    return check


@values
def dual_norm():
    rng = np.random.default_rng(17)
    size = 10.0 ** rng.uniform(-15, 15, COUNT)
    given = rng.normal(size=(COUNT, 8)) * size[:, None]
    real, dual = exact(given[:, :4]), exact(given[:, 4:])
    return (given,), rounded(np.stack([e.length(real), e.dot(real, dual) / e.length(real)])), size


def dual_log(_name, function):
    cases = motions(3)
    for dtype in FLOATS:
        got = function(cases.of("dual_quat", dtype))
        assert not got[:, [0, 4]].any()
        agree_twists(2 * got[:, [1, 2, 3, 5, 6, 7]], 3, cases.size)


def dual_exp(_name, function):
    (twist,), motion, size, rotation = twists_to_exp()
    want = in_layout(motion, "dual_quat")
    zero = np.zeros(COUNT)
    given = np.column_stack([zero, twist[:, :3] / 2, zero, twist[:, 3:] / 2])
    agree_all_motions("dual_quat", function, (given,), want, size, rotation=rotation)


def power(_name, function):
    cases = motions(18)
    rng = np.random.default_rng(18)
    exponent = rng.choice([0.0, 1.0, -1.0, 0.5, 1e-6, np.nan], COUNT)
    exponent = np.where(np.isnan(exponent), rng.uniform(-3, 3, COUNT), exponent)
    one, other = (
        in_layout(e.power(motion, e.number(exponent)), "dual_quat")
        for motion in (cases.exact, _other_way(cases.exact))
    )
    w = np.abs(cases.dual_quat[:, 0])
    for dtype in FLOATS:
        got = function(cases.of("dual_quat", dtype), exponent.astype(dtype))
        off = [np.abs(np.abs(np.einsum("ni,ni->n", got[:, :4], of[:, :4])) - 1) for of in (one, other)]
        flips = (w < 8 * step_of(dtype)) & (off[1] < off[0])
        want = np.where(flips[:, None], other, one)
        agree_motions(got, "dual_quat", want, cases.size * (1 + np.abs(exponent)), rotation=4.0)


# --- Quaternions


def quat(check):
    """The same checks for sinew.quat as for pairs, without translations."""

    def of_quaternions(_name, function):
        def as_pairs(*arguments):
            rotated = [a[..., :4] if a.shape[-1:] == (7,) else a for a in arguments]
            result = function(*rotated)
            return np.concatenate([result, np.zeros((*result.shape[:-1], 3), result.dtype)], axis=-1)

        check("quat_vec", as_pairs)

    return of_quaternions


def unit_quaternions(*seeds):
    return tuple(motions(seed).quat_vec[:, :4] for seed in seeds)


@values
def quat_compose():
    return unit_quaternions(8, 9), rounded(e.product(motions(8).exact.q, motions(9).exact.q)), 1.0


@values
def quat_norm():
    rng = np.random.default_rng(25)
    size = 10.0 ** rng.uniform(-30, 30, COUNT)
    q = rng.normal(size=(COUNT, 4)) * size[:, None]
    return (q,), e.length(exact(q)).astype(np.float64), size


@values
def quat_normalized():
    rng = np.random.default_rng(26)
    q = motions(26).quat_vec[:, :4] * (10.0 ** rng.uniform(-30, 30, COUNT))[:, None]
    return (q,), rounded(e.unit(exact(q))), 1.0


@values
def quat_rotate():
    v = points(11)
    return (*unit_quaternions(11), v), rounded(e.times(e.matrix(motions(11).exact.q), exact(v))), lengths(v)


@values
def to_rotation_matrix():
    return unit_quaternions(5), motions(5).affine[:, :3, :3], 1.0


@values
def from_rotation_vector():
    rng = np.random.default_rng(27)
    angle = angles(rng) * np.where(np.arange(COUNT) % 5 == 0, 10.0 ** rng.uniform(0, 5, COUNT), 1.0)
    vector = directions(rng) * angle[:, None]
    return (vector,), rounded(e.from_rotation_vector(exact(vector))), 1.0 + angle


def to_rotation_vector(_name, function):
    cases = motions(3)
    for dtype in FLOATS:
        vectors = function(cases.quat_vec[:, :4].astype(dtype))
        one, other, w = twists(3)
        flips = (w < 8 * step_of(dtype)) & (np.einsum("ni,ni->n", vectors, one[:, :3]) < 0)
        want = np.where(flips[:, None], other, one)[:, :3]
        agree(vectors, want, lengths(want))


@values
def angle_between():
    a, b = pairs(13)
    return (a.quat_vec[:, :4], b.quat_vec[:, :4]), exact_distance(a.exact, b.exact)[0], 1.0


def slerp(_name, function):
    a, b = pairs(28)
    t = np.random.default_rng(28).uniform(-0.25, 1.25, COUNT)
    t[::7], t[1::7] = 0.0, 1.0
    step = e.product(e.conjugate(a.exact.q), b.exact.q)
    want = rounded(e.product(a.exact.q, e.from_rotation_vector(e.number(t) * e.rotation_vector(step))))
    along = np.abs(step[0].astype(np.float64))
    for dtype in FLOATS:
        got = function(a.quat_vec[:, :4].astype(dtype), b.quat_vec[:, :4].astype(dtype), t.astype(dtype))
        sign = np.where(np.einsum("ni,ni->n", got, want) < 0, -1.0, 1.0)
        # 180 degrees apart, rounding decides between the two ways.
        agree(got, want * sign[:, None], 1.0, where=along > 8 * step_of(dtype))


def to_three_numbers(_name, function):
    q = motions(29).quat_vec[:, :4]
    want = np.where(q[:, :1] < 0, -q[:, 1:], q[:, 1:])
    for dtype in FLOATS:
        given = q.astype(dtype)
        got = function(given)
        # -0 and 0 are the two signs of a rotation by 180 degrees.
        same = np.where((given[:, :1] == 0), np.abs(want), want)
        np.testing.assert_array_equal(np.where(given[:, :1] == 0, np.abs(got), got), same.astype(dtype))


def from_three_numbers(_name, function):
    q = motions(29).quat_vec[:, :4]
    v = np.where(q[:, :1] < 0, -q[:, 1:], q[:, 1:])
    number = exact(v)
    rest = 1 - e.dot(number, number)
    w = e.sqrt(np.where(rest > 0, rest, rest * 0))
    want = rounded(e.unit(np.concatenate([w[None], number])))
    for dtype in FLOATS:
        got = function(v.astype(dtype))
        # w is the square root of a difference from 1: half of the digits are lost where that is nearly 0.
        agree(got, want, 1.0 / np.maximum(want[:, 0], np.sqrt(step_of(dtype))))


# --- Dual numbers


@functools.cache
def dual_numbers(seed):
    rng = np.random.default_rng(seed)
    real = 10.0 ** rng.uniform(-10, 10, COUNT)
    return np.column_stack([real, rng.normal(size=COUNT) * 10.0 ** rng.uniform(-10, 10, COUNT)])


def agree_parts(function, given, want, sizes):
    for part, size in enumerate(sizes):
        agree_all(lambda *numbers, part=part: function(*numbers)[:, part], given, want[:, part], size)


def dual(of, size, signed=True):
    """`of`(a) or (a, b) in pairs of numbers. size: what errors of both parts are relative to, float64."""

    def check(_name, function):
        a, b = dual_numbers(30).copy(), dual_numbers(31).copy()
        if signed:
            a[::2] *= -1
        given = (a, b)[: of.__code__.co_argcount]
        want = rounded(np.stack(of(*map(exact, given))))
        agree_parts(function, given, want, size(*given))

    return check


def near(of, size, low, high):
    """The same for real numbers, whose functions of angles or powers are known."""

    def check(_name, function):
        rng = np.random.default_rng(32)
        real = rng.uniform(low, high, COUNT)
        real[::5] = 10.0 ** rng.uniform(-12, -2, len(real[::5]))
        a = np.column_stack([real, dual_numbers(30)[:, 1]])
        want = rounded(np.stack(of(exact(a))))
        agree_parts(function, (a,), want, size(a))

    return check


def of_angle(a):
    """sin and cos: includes rounding of the angle."""
    return 1 + np.abs(a[:, 0]), np.abs(a[:, 1]) * (1 + np.abs(a[:, 0]))


DUAL = {
    "dual.multiply": dual(
        lambda a, b: (a[0] * b[0], a[0] * b[1] + a[1] * b[0]),
        lambda a, b: (np.abs(a[:, 0] * b[:, 0]), np.abs(a[:, 0] * b[:, 1]) + np.abs(a[:, 1] * b[:, 0])),
    ),
    "dual.divide": dual(
        lambda a, b: (a[0] / b[0], a[1] / b[0] - a[0] / b[0] * b[1] / b[0]),
        lambda a, b: (
            np.abs(a[:, 0] / b[:, 0]),
            np.abs(a[:, 1] / b[:, 0]) + np.abs(a[:, 0] / b[:, 0] * b[:, 1] / b[:, 0]),
        ),
    ),
    "dual.conjugate": dual(lambda a: (a[0], -a[1]), lambda a: (np.abs(a[:, 0]), np.abs(a[:, 1]))),
    "dual.sqrt": dual(
        lambda a: (e.sqrt(a[0]), a[1] / (2 * e.sqrt(a[0]))),
        lambda a: (np.sqrt(a[:, 0]), np.abs(a[:, 1]) / np.sqrt(a[:, 0])),
        signed=False,
    ),
    "dual.log": dual(
        lambda a: (e.log(a[0]), a[1] / a[0]),
        lambda a: (1 + np.abs(np.log(a[:, 0])), np.abs(a[:, 1]) / a[:, 0]),
        signed=False,
    ),
    "dual.sin": near(lambda a: (e.sin(a[0]), a[1] * e.cos(a[0])), of_angle, -20, 20),
    "dual.cos": near(lambda a: (e.cos(a[0]), -a[1] * e.sin(a[0])), of_angle, -20, 20),
    "dual.exp": near(
        lambda a: (e.exp(a[0]), a[1] * e.exp(a[0])),
        lambda a: (np.exp(a[:, 0]) * 21, np.abs(a[:, 1]) * np.exp(a[:, 0]) * 21),
        -20,
        20,
    ),
}

REPRESENTATIONS = {
    "compose": compose,
    "from_axis_angle": from_axis_angle,
    "from_rotation_matrix": from_rotation_matrix,
    "from_screw": from_screw,
    "from_screw_about": from_screw_about,
    "from_translation": from_translation,
    "from_twist": from_twist,
    "identity": identity,
    "inverse": inverse,
    "normalized": normalized,
    "rigid_distance": rigid_distance,
    "to_affine": to_layout("affine"),
    "to_dual_quat": to_layout("dual_quat"),
    "to_quat_vec": to_layout("quat_vec"),
    "to_screw": to_screw,
    "to_twist": to_twist,
    "transform_normal": transform_normal,
    "transform_point": transform_point,
    "transform_vector": transform_vector,
}

# Checks by module and function: check(module's name, function).
CHECKS = {
    **{
        f"{layout}.{function}": check
        for layout in LAYOUTS
        for function, check in REPRESENTATIONS.items()
        if function != f"to_{layout}"
    },
    "affine.split_scale": split_scale,
    "dual_quat.conjugate": signs(1, -1, -1, -1, 1, -1, -1, -1),
    "dual_quat.dual_conjugate": signs(1, 1, 1, 1, -1, -1, -1, -1),
    "dual_quat.combined_conjugate": signs(1, -1, -1, -1, -1, 1, 1, 1),
    "dual_quat.norm": dual_norm,
    "dual_quat.log": dual_log,
    "dual_quat.exp": dual_exp,
    "dual_quat.power": power,
    "quat.from_axis_angle": quat(from_axis_angle),
    "quat.from_rotation_matrix": quat(from_rotation_matrix),
    "quat.from_rotation_vector": from_rotation_vector,
    "quat.to_rotation_vector": to_rotation_vector,
    "quat.to_rotation_matrix": to_rotation_matrix,
    "quat.compose": quat_compose,
    "quat.conjugate": signs(1, -1, -1, -1),
    "quat.norm": quat_norm,
    "quat.normalized": quat_normalized,
    "quat.rotate": quat_rotate,
    "quat.angle_between": angle_between,
    "quat.slerp": slerp,
    "quat.to_three_numbers": to_three_numbers,
    "quat.from_three_numbers": from_three_numbers,
    **DUAL,
}
