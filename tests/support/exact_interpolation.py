# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks with 50 digits: sinew.interpolate, sinew.spline."""

import functools
import itertools

import exact as e
import numpy as np
import sinew
from exact import Motion, exact, rounded
from exact_cases import (
    COUNT,
    FLOATS,
    LAYOUTS,
    agree,
    agree_motions,
    angles,
    cases_of,
    in_layout,
    largest,
    motion_of,
    motions,
    nearest_rotations,
    of_each,
    points,
    quaternions,
    shares,
    step_of,
    translations,
)
from motions import LAYOUT_OF

BONES = 8
GROUPS = COUNT // BONES
# If two ways are equally short to within about this, the result must be reported as not defined.
TIE = 1e-6


def sizes(array, name):
    """The sizes [..] of the translations."""
    array = np.asarray(array, np.float64)
    if name == "affine":
        return np.linalg.norm(array[..., :3, 3], axis=-1)
    # The dual part is half as long as the translation.
    return np.linalg.norm(array[..., 4:], axis=-1) * (2 if name == "dual_quat" else 1)


def numbers_of(array, name):
    """Transforms in the layout, float64, as numbers with components first: 16, 7 or 8."""
    array = np.asarray(array, np.float64)
    return exact(array.reshape(*array.shape[:-2], 16) if name == "affine" else array)


def array_of(numbers, name):
    array = rounded(numbers)
    return array.reshape(*array.shape[:-1], 4, 4) if name == "affine" else array


# --- Weighted sums


def linear_blend(arrays, weights, method):
    """float64 [n, ..] of transforms [n, k, ..] with weights [k, n] of sum 1 and unchanged signs; and what
    errors of rotations are relative to."""
    name = LAYOUT_OF[method]
    numbers = numbers_of(arrays, name)
    total = (numbers * weights.T[None]).sum(axis=2)
    ones = np.ones(len(arrays))
    if method == "matrix_linear":
        return array_of(total, name), ones
    if method == "matrix_polar":
        result, _size, gap = nearest_rotations(array_of(total, name))
        return result, 1 / np.maximum(gap, 1e-12)
    size = e.length(total[:4])
    cancels = 1 / size.astype(np.float64)
    if method == "qv_nlerp":
        return rounded(np.concatenate([total[:4] / size, total[4:]])), cancels
    return in_layout(e.of_dual(total[:4], total[4:]), name), cancels


def log_blend(motions, shape, weights):
    """float64 [n, 4, 4] of motions [n, k] with weights [k, n], and how near to 180 degrees from the identity
    a rotation is."""
    angular, linear = (twist.reshape(3, *shape) for twist in e.to_twist(motions))
    motion = e.from_twist((angular * weights.T[None]).sum(axis=2), (linear * weights.T[None]).sum(axis=2))
    return in_layout(motion, "affine"), np.abs(motions.q[0].astype(np.float64)).reshape(shape).min(axis=1)


def agree_blend(got, name, want, size, cancels, where):
    """The blend by a method whose result is known."""
    # Cancellation makes the length uncertain by which a dual quaternion's translation is divided.
    size = size * cancels * (cancels if name == "dual_quat" else 1.0)
    agree_motions(got, name, want, size, rotation=cancels, where=where)


# --- Between two


@functools.cache
def between_cases():
    """Two Cases and t, [COUNT], with the same t for each group of BONES."""
    rng = np.random.default_rng(101)
    first = motions(101)
    step = Motion(e.unit(exact(quaternions(rng, angles(rng)))), exact(translations(rng)))
    second = cases_of(e.compose(first.exact, step))
    t = rng.uniform(-0.25, 1.25, GROUPS)
    t[::6], t[1::6], t[2::6] = 0.0, 1.0, 0.5
    t[3::12] = 10.0 ** rng.uniform(-6, -2, len(t[3::12]))
    return first, second, np.repeat(t, BONES)


@functools.cache
def between_wanted(method):
    """The result as float64 in the layout, sizes, what errors of rotations are relative to, and whether
    it is defined; NaN near where that changes."""
    a, b, t = between_cases()
    name = LAYOUT_OF[method]
    size = (a.size + b.size) * (1 + np.abs(t))
    ones, apart = np.ones(COUNT), np.abs(e.dot(a.exact.q, b.exact.q).astype(np.float64))
    inner = (t != 0) & (t != 1)
    weights = np.stack([e.number(1.0) - e.number(t), e.number(t)])
    if method.startswith("matrix"):
        if method == "matrix_log":
            ends = Motion(
                *(
                    np.stack(pair, axis=2).reshape(len(pair[0]), -1)
                    for pair in zip(a.exact, b.exact, strict=True)
                )
            )
            want, w = log_blend(ends, (COUNT, 2), weights)
            # A matrix of weight 1 is the result, whichever logarithm it has.
            return want, size, ones * 4, _defined(np.where(inner, w, 1.0))
        want, cancels = linear_blend(np.stack([a.affine, b.affine], axis=1), weights, method)
        linear = method == "matrix_linear"
        # The library's gap is twice the sum of the smaller singular values.
        return want, size, cancels, _defined(ones if linear else 2 / cancels)
    if method == "dib":
        return between_wanted("sclerp")
    if method in ("qv_slerp", "sclerp"):
        want = _spherical(a, b, t, method)
        return want, size, ones, _defined(np.where(inner, apart, 1.0))
    onto = second_on_one_side(getattr(a, name), getattr(b, name), name)
    want, cancels = linear_blend(np.stack([getattr(a, name), onto], axis=1), weights, method)
    return want, size, cancels, _defined(np.where(inner, apart, 1.0))


def _spherical(a, b, t, method):
    """From logarithm and exponential, of rotations or of screws."""
    t = e.number(t)
    if method == "qv_slerp":
        step = e.product(e.conjugate(a.exact.q), b.exact.q)
        q = e.product(a.exact.q, e.from_rotation_vector(t * e.rotation_vector(step)))
        return rounded(np.concatenate([q, (1 - t) * a.exact.t + t * b.exact.t]))
    step = e.compose(e.inverse(a.exact), b.exact)
    return in_layout(e.compose(a.exact, e.power(step, t)), "dual_quat")


def _defined(margin):
    return np.where(np.abs(margin / TIE - 1) < 0.1, np.nan, margin > TIE)


def second_on_one_side(first, second, name):
    flips = np.einsum("ni,ni->n", first[:, :4], second[:, :4]) < 0
    signs = np.where(np.arange(first.shape[1]) < (8 if name == "dual_quat" else 4), -1.0, 1.0)
    return np.where(flips[:, None], second * signs, second)


def agree_defined(got, want, dtype):
    """Where float32 may decide differently, either answer is allowed."""
    same = (got == want) | np.isnan(want)
    if dtype == np.float32:
        same |= ~np.asarray(got, bool)
    assert same.all(), f"is_defined of case {np.argmin(same)} is {got[np.argmin(same)]}"


def between(method):
    def check(_name, function):
        a, b, t = between_cases()
        name = LAYOUT_OF[method]
        want, size, cancels, is_defined = between_wanted(method)
        for dtype in FLOATS:
            got = function(a.of(name, dtype), b.of(name, dtype), t.astype(dtype), method)
            agree_defined(got.is_defined, is_defined, dtype)
            agree_blend(got.transforms, name, want, size, cancels, got.is_defined)

    return check


# --- Of many

MANY = 3


@functools.cache
def blend_cases(width):
    """Cases [COUNT * MANY] about a middle, rotated by up to `width` radians from it, and weights [COUNT,
    MANY] whose sum is not 1; some are 0, negative or equal."""
    rng = np.random.default_rng(int(10 * width) + 200)
    middle = motions(102).exact.take(np.repeat(np.arange(COUNT), MANY))
    count = COUNT * MANY
    angle = rng.uniform(0, width, count) * np.where(np.arange(count) // MANY % 5 == 1, 1e-6, 1.0)
    step = Motion(e.unit(exact(quaternions(rng, angle))), exact(translations(rng, count)))
    cases = cases_of(e.compose(middle, step))
    weights = rng.uniform(0.1, 1.0, (COUNT, MANY))
    weights[::7, 0] = 0.0
    weights[1::7, 1] *= -0.1
    weights[2::7] = 1.0
    return cases, weights * 10.0 ** rng.uniform(-3, 3, (COUNT, 1))


def signs_by_rule(quaternions, weights, rule):
    """Signs [n, k], and how far the choice is from a tie, in float64."""
    signs, margin = np.ones(weights.shape), np.ones(len(weights))
    if rule == "as_given":
        return signs, margin
    if rule == "heaviest":
        pivot = quaternions[np.arange(len(weights)), np.argmax(weights, axis=1)]
        along = np.einsum("nki,ni->nk", quaternions, pivot)
        along = np.where(weights == 0, 1.0, along)
        return np.where(along < 0, -1.0, 1.0), np.abs(along).min(axis=1)
    total = np.zeros((len(weights), 4))
    unit_weights = weights / weights.sum(axis=1, keepdims=True)
    for k in range(weights.shape[1]):
        along = np.einsum("ni,ni->n", total, quaternions[:, k])
        counts = (weights[:, k] != 0) & total.any(axis=1)
        signs[:, k] = np.where(counts & (along < 0), -1.0, 1.0)
        margin = np.where(counts, np.minimum(margin, np.abs(along)), margin)
        total += (signs[:, k] * unit_weights[:, k])[:, None] * quaternions[:, k]
    return signs, margin


RULES = ("heaviest", "running_sum", "as_given")


def blend_of_sums(method):
    """Checks each rule of signs."""

    def check(_name, function):
        name = LAYOUT_OF[method]
        cases, weights = blend_cases(np.pi)
        arrays, part = of_each(getattr(cases, name), MANY), shares(weights)
        size = largest(sizes(arrays, name)) * np.abs(part).sum(axis=0).astype(np.float64)
        # Matrices have no sign.
        for rule in RULES if name != "affine" else RULES[:1]:
            aligned, margin = arrays, np.ones(COUNT)
            if name != "affine":
                signs, margin = signs_by_rule(arrays[..., :4], weights, rule)
                aligned = with_signs(arrays, signs, name)
            want, cancels = linear_blend(aligned, part, method)
            for dtype in FLOATS:
                got = function(arrays.astype(dtype), weights.astype(dtype), method, rule)
                # With equal weights the order decides.
                assert got.is_defined.mean() > 0.7
                where = got.is_defined & (margin > 100 * step_of(dtype))
                agree_blend(got.transforms, name, want, size, cancels, where)

    return check


def with_signs(arrays, signs, name):
    count = 8 if name == "dual_quat" else 4
    return arrays * np.where(np.arange(arrays.shape[-1]) < count, signs[..., None], 1.0)


def blend_of_logarithms(_name, function):
    cases, weights = blend_cases(0.7)
    arrays, part = of_each(cases.affine, MANY), shares(weights)
    want, w = log_blend(cases.exact, (COUNT, MANY), part)
    size = largest(cases.size.reshape(COUNT, MANY)) * np.abs(part).sum(axis=0).astype(np.float64)
    for dtype in FLOATS:
        got = function(arrays.astype(dtype), weights.astype(dtype), "matrix_log")
        np.testing.assert_array_equal(got.is_defined[w > 2 * TIE], True)
        agree_blend(got.transforms, "affine", want, size, np.full(COUNT, 4.0), got.is_defined)


def blend_of_screws(method):
    """The blend of n, where the weighted logarithms to the transforms (of rotations, or of screws) sum to
    0, for every rule of signs, since the transforms are less than 180 degrees apart."""

    def check(_name, function):
        name = LAYOUT_OF[method]
        cases, weights = blend_cases(0.7)
        part = shares(weights)
        arrays = of_each(getattr(cases, name), MANY)
        size = largest(cases.size.reshape(COUNT, MANY)) * np.abs(part).sum(axis=0).astype(np.float64)
        one_side = with_signs(arrays, signs_by_rule(arrays[..., :4], weights, "heaviest")[0], name)
        means = function(arrays, weights, method).transforms
        if method == "dib":
            np.testing.assert_array_equal(means, function(arrays, weights, "sclerp").transforms)
        else:
            indices = np.arange(COUNT * MANY).reshape(COUNT, MANY)
            assert agree_mean(means, name, cases.exact, indices, part, size) < np.pi / 2
        for dtype in FLOATS:
            for rule, given in zip(RULES, (arrays, arrays, one_side), strict=True):
                got = function(given.astype(dtype), weights.astype(dtype), method, rule)
                assert got.is_defined.all()
                agree_motions(got.transforms, name, means, size)

    return check


def agree_mean(got, name, motions, indices, weights, size):
    """Asserts that the weighted logarithms, weights [k, n], from `got` [n, ..] to the motions with these
    indices [n, k] sum to 0."""
    dtype, mean, largest_angle = got.dtype, motion_of(got, name), 0.0
    assert np.abs(np.linalg.norm(got[:, :4].astype(np.float64), axis=1) - 1).max() < 8 * step_of(dtype)
    sums = [e.number(np.zeros((3, COUNT))), e.number(np.zeros((3, COUNT)))]
    for k, weight in enumerate(weights):
        motion = motions.take(indices[:, k])
        if name == "dual_quat":
            angular, linear = e.to_twist(e.compose(e.inverse(mean), motion))
        else:
            angular = e.rotation_vector(e.product(e.conjugate(mean.q), motion.q))
            linear = motion.t - mean.t
        sums = sums[0] + weight * angular, sums[1] + weight * linear
        largest_angle = max(largest_angle, np.linalg.norm(rounded(angular), axis=1).max())
    agree(rounded(sums[0]).astype(dtype), np.zeros((COUNT, 3)), 1.0)
    agree(rounded(sums[1]).astype(dtype), np.zeros((COUNT, 3)), size)
    return largest_angle


# --- Splines

CURVES, TIMES, KEYS = 40, 50, 6


@functools.cache
def spline_cases():
    """Cases [CURVES * KEYS], each key within 60 degrees of the one before; times [CURVES, KEYS] and the
    times to evaluate [CURVES, TIMES], float32 numbers, the same for each BONES curves; before, at and
    after keys, and a cut."""
    rng = np.random.default_rng(103)
    count = CURVES * KEYS
    step = Motion(
        e.unit(exact(quaternions(rng, rng.uniform(0, np.pi / 3, count)))), exact(translations(rng, count))
    )
    keys = [motions(104).exact.take(np.arange(CURVES))]
    for key in range(1, KEYS):
        keys.append(e.compose(keys[-1], step.take(np.arange(CURVES) * KEYS + key)))
    order = (np.arange(count) % KEYS) * CURVES + np.arange(count) // KEYS
    joined = Motion(np.concatenate([k.q for k in keys], axis=1), np.concatenate([k.t for k in keys], axis=1))
    times = np.cumsum(rng.integers(1, 64, (CURVES // BONES, KEYS)), axis=1) / 16.0
    times[1::2, 3] = times[1::2, 2]
    at = np.floor(rng.uniform(times[:, :1] - 1, times[:, -1:] + 1, (CURVES // BONES, TIMES)) * 1024) / 1024
    at[:, :KEYS] = times
    return cases_of(joined.take(order)), np.repeat(times, BONES, axis=0), np.repeat(at, BONES, axis=0)


@functools.cache
def spline_terms():
    """Indices of four keys [COUNT, 4] and their weights, numbers [4, COUNT]: of the Hermite form's two
    keys and of those that determine their tangents."""
    _cases, times, at = spline_cases()
    indices = np.zeros((COUNT, 4), int)
    weights = e.number(np.zeros((4, COUNT)))
    for case in range(COUNT):
        curve, moment = divmod(case, TIMES)
        keys, of = curve_weights(times[curve], at[curve, moment])
        indices[case] = curve * KEYS + np.array(keys)
        weights[:, case] = of
    return indices, weights


def interval(times, at):
    """Key, next key, the elapsed part of the interval and its length, numbers; the same key twice outside."""
    last = len(times) - 1
    key = max((k for k in range(last + 1) if times[k] <= at), default=0)
    if at < times[0] or key == last:
        return key, key, e.number(0.0), e.number(0.0)
    start, end, at = (e.number(float(time)) for time in (times[key], times[key + 1], at))
    return key, key + 1, (at - start) / (end - start), end - start


def curve_weights(times, at):
    one, none = e.number(1.0), e.number(0.0)
    last = len(times) - 1
    key, after, u, whole = interval(times, at)
    if key == after:
        return (key,) * 4, (none, one, none, none)
    before = key - 1 if key > 0 and times[key - 1] < times[key] else key
    beyond = key + 2 if key + 1 < last and times[key + 1] < times[key + 2] else key + 1
    exact_times = [e.number(float(time)) for time in times]

    # Cardinal functions: the curve with 1 at one key and 0 at the others.
    def curve(ones):
        def value(k):
            return one if k == ones else none

        leave = (value("next") - value("before" if before != key else "key")) * whole
        leave = leave / (exact_times[key + 1] - exact_times[before])
        arrive = (value("beyond" if beyond != key + 1 else "next") - value("key")) * whole
        arrive = arrive / (exact_times[beyond] - exact_times[key])
        points = [value("key"), value("key") + leave / 3, value("next") - arrive / 3, value("next")]
        while len(points) > 1:
            points = [(1 - u) * p + u * q for p, q in itertools.pairwise(points)]
        return points[0]

    weights = [curve(name) for name in ("before", "key", "next", "beyond")]
    return (before, key, key + 1, beyond), weights


def on_one_side(arrays, name):
    """Signs along the chain, [n, 4, ..], from the second key."""
    if name == "affine":
        return arrays
    q = arrays[..., :4].copy()
    signs = np.ones(arrays.shape[:2])
    for onto, of in ((0, 1), (2, 1), (3, 2)):
        along = np.einsum("ni,ni->n", q[:, onto], q[:, of]) * signs[:, of]
        signs[:, onto] = np.where(along < 0, -1.0, 1.0)
    return with_signs(arrays, signs, name)


@functools.cache
def spline_wanted(method):
    """float64 [COUNT, ..], sizes, and what errors of rotations are relative to."""
    name = LAYOUT_OF[method]
    cases = spline_cases()[0]
    indices, weights = spline_terms()
    arrays = on_one_side(getattr(cases, name)[indices], name)
    size = largest(cases.size[indices])
    if method == "matrix_log":
        want, _w = log_blend(cases.exact.take(indices.ravel()), indices.shape, weights)
        return want, size * 4, np.full(COUNT, 4.0)
    if method in ("qv_slerp", "sclerp", "dib"):
        return None, size, np.ones(COUNT)
    want, cancels = linear_blend(arrays, weights, method)
    return want, size, cancels


def agree_spline(got, is_defined, method):
    name = LAYOUT_OF[method]
    want, size, cancels = spline_wanted(method)
    if method != "matrix_log":
        assert is_defined.all()
    if want is not None:
        agree_blend(got, name, want, size, cancels, is_defined)
    elif got.dtype == np.float32:
        agree_motions(got, name, of_curves(method, np.float64)[0], size)
    elif method == "dib":
        np.testing.assert_array_equal(got, of_curves("sclerp", np.float64)[0])
    else:
        cases = spline_cases()[0]
        agree_mean(got, name, cases.exact, *spline_terms(), size)


def by_curve(function, dtype, *keyed, method=()):
    """(transforms, is_defined) for every case, curve after curve, of arrays [CURVES * KEYS, ..]."""
    _cases, times, at = spline_cases()
    keyed = [array.reshape(CURVES, KEYS, *array.shape[1:]) for array in (*keyed, times.ravel())]
    found = [function(*(array[c].astype(dtype) for array in (*keyed, at)), *method) for c in range(CURVES)]
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))


@functools.cache
def of_curves(method, dtype):
    keys = getattr(spline_cases()[0], LAYOUT_OF[method])
    return by_curve(sinew.spline.catmull_rom, dtype, keys, method=(method,))


def catmull_rom(method):
    def check(_name, _function):
        for dtype in FLOATS:
            agree_spline(*of_curves(method, dtype), method)

    return check


@functools.cache
def vector_wanted(name):
    """float64 [COUNT, ..]: blended components, also of points."""
    cases = spline_cases()[0]
    indices, weights = spline_terms()
    if name == "points":
        arrays = points(105)[indices]
        return rounded((exact(arrays) * weights.T[None]).sum(axis=2)), largest(arrays)
    arrays = on_one_side(getattr(cases, name)[indices], name)
    want = array_of((numbers_of(arrays, name) * weights.T[None]).sum(axis=2), name)
    return want, largest(cases.size[indices])


def catmull_rom_vector(_name, function):
    for name in (*LAYOUTS, "points"):
        keys = points(105)[: CURVES * KEYS] if name == "points" else getattr(spline_cases()[0], name)
        want, size = vector_wanted(name)
        for dtype in FLOATS:
            got, is_defined = by_curve(function, dtype, keys)
            assert is_defined.all()
            if name == "points":
                agree(got, want, size)
            else:
                agree_motions(got, name, want, size, signed=True)


BLENDS = {
    "matrix_log": blend_of_logarithms,
    **{method: blend_of_sums(method) for method in ("matrix_linear", "matrix_polar", "qv_nlerp", "dlb")},
    **{method: blend_of_screws(method) for method in ("qv_slerp", "sclerp", "dib")},
}

# Checks by module, function and method.
CHECKS = {
    **{f"interpolate.between.{method}": between(method) for method in LAYOUT_OF},
    **{f"interpolate.blend.{method}": BLENDS[method] for method in LAYOUT_OF},
    **{f"spline.catmull_rom.{method}": catmull_rom(method) for method in LAYOUT_OF},
    "spline.catmull_rom_vector": catmull_rom_vector,
}
