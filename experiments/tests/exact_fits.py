# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks with 50 digits: future_work.fit. Verifies the conditions that make a fit the best one, in numbers
that do not round."""

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
    in_layout,
    motion_of,
    motions,
    of_each,
    quaternions,
    shares,
)

POINTS, POSES = 5, 3


@functools.cache
def point_cases():
    """source, target [COUNT, POINTS, 3] and weights [COUNT, POINTS]: exact, noisy, far from the origin,
    tiny, huge, and mirror images."""
    rng = np.random.default_rng(301)
    size = 10.0 ** np.where(np.arange(COUNT) % 5 == 1, rng.uniform(-12, 12, COUNT), 0.0)
    source = rng.normal(size=(COUNT, POINTS, 3)) + 10.0 * rng.normal(size=(COUNT, 1, 3))
    noise = np.choose(np.arange(COUNT) % 4, [0.0, 1e-6, 1e-2, 0.3])
    mirror = np.where(np.arange(COUNT) % 7 == 0, -1.0, 1.0)
    turned = np.einsum("nij,npj->npi", motions(301).affine[:, :3, :3], source * mirror[:, None, None])
    target = (
        turned + 5.0 * rng.normal(size=(COUNT, 1, 3)) + noise[:, None, None] * rng.normal(size=source.shape)
    )
    weights = rng.uniform(0.1, 1.0, (COUNT, POINTS)) * size[:, None]
    weights[::6, 0] = 0.0
    return source * size[:, None, None], target * size[:, None, None], weights


@functools.cache
def moments():
    """The exact middles [3, COUNT] of both, and the weighted sum of target source^T about them, scaled to
    size 1."""
    source, target, weights = point_cases()
    part = shares(weights)
    p, q = exact(source), exact(target)
    middles = [(points * part.T[None]).sum(axis=2) for points in (p, q)]
    p, q = p - middles[0][:, :, None], q - middles[1][:, :, None]
    covariance = np.array(
        [[(q[i] * p[j] * part.T).sum(axis=1) for j in range(3)] for i in range(3)], dtype=object
    )
    size = e.sqrt(((p * p + q * q) * part.T[None]).sum(axis=(0, 2)))
    return *middles, covariance / size**2, size.astype(np.float64)


def rigid(_name, function):
    """Asserts that the squares are the least for all rotations: R^T C is symmetric, no two of its
    eigenvalues have a negative sum (so it is the maximum, not another stationary point), and the middle
    maps to the middle."""
    source, target, weights = point_cases()
    first, second, covariance, size = moments()
    reach = np.abs(np.concatenate([source, target], axis=1)).max(axis=(1, 2))
    singular = np.linalg.svd(np.moveaxis(covariance.astype(np.float64), -1, 0))[1]
    mirrored = np.linalg.det(np.moveaxis(covariance.astype(np.float64), -1, 0)) < 0
    gap = singular[:, 1] + np.where(mirrored, -1, 1) * singular[:, 2]
    for dtype in FLOATS:
        fit = function(*(a.astype(dtype) for a in (source, target, weights)))
        # For a mirror image the gap is a difference, of which rounding may leave nothing.
        assert fit.is_defined[gap > 1e-3].all()
        motion = motion_of(fit.transforms, "quat_vec")
        rotation = e.matrix(motion.q)
        aligned = e.matmul(np.swapaxes(rotation, 0, 1), covariance)
        skew = np.array(
            [aligned[2, 1] - aligned[1, 2], aligned[0, 2] - aligned[2, 0], aligned[1, 0] - aligned[0, 1]]
        )
        # Rounding of coordinates far from the origin is relative to their size.
        far = reach / size
        agree(rounded(skew).astype(dtype), np.zeros((COUNT, 3)), 1 + far)
        symmetric = np.moveaxis(((aligned + np.swapaxes(aligned, 0, 1)) / 2).astype(np.float64), -1, 0)
        least_two = np.linalg.eigvalsh(symmetric)[:, :2].sum(axis=1)
        assert (least_two > -1e-5 if dtype == np.float32 else least_two > -1e-12).all()
        moved = e.times(rotation, first) + motion.t
        agree(rounded(moved).astype(dtype), rounded(second), reach * 4)
        agree_error(fit, motion, dtype, far)
        clear = np.abs(np.linalg.det(np.moveaxis(covariance.astype(np.float64), -1, 0))) > 1e-4
        np.testing.assert_array_equal(fit.is_mirrored[clear], mirrored[clear])


def agree_error(fit, motion, dtype, far):
    source, target, weights = point_cases()
    part = shares(weights)
    square = e.number(np.zeros(COUNT))
    for k in range(POINTS):
        off = e.rotate(motion.q, exact(source[:, k])) + motion.t - exact(target[:, k])
        square = square + part[k] * e.dot(off, off)
    want = e.sqrt(square).astype(np.float64)
    agree(fit.error, want, moments()[3] * (1 + far) * 4)


# --- Hand and eye


@functools.cache
def hand_eye_cases():
    """x, and motions a [COUNT, POSES] with b = x^-1 a x. The axes of the first two differ by at least 30
    degrees."""
    rng = np.random.default_rng(302)
    x = motions(302).exact
    x = Motion(x.q, exact(rng.normal(size=(COUNT, 3))))
    count = COUNT * POSES
    axes = directions(rng, count).reshape(COUNT, POSES, 3)
    across = np.cross(axes[:, 0], directions(rng))
    across = np.where(
        np.linalg.norm(across, axis=1)[:, None] > 0.1, across, np.cross(axes[:, 0], [0.6, 0, 0.8])
    )
    axes[:, 1] = (
        axes[:, 0] + rng.uniform(0.6, 3.0, (COUNT, 1)) * across / np.linalg.norm(across, axis=1)[:, None]
    )
    angle = rng.uniform(0.3, 2.8, count)
    sign = rng.choice([-1.0, 1.0], (1, count))
    a = Motion(
        e.from_axis_angle(exact(axes.reshape(count, 3)), e.number(angle)) * e.number(sign),
        exact(rng.normal(size=(count, 3))),
    )
    repeated = x.take(np.repeat(np.arange(COUNT), POSES))
    b = e.compose(e.compose(e.inverse(repeated), a), repeated)
    return cases_of(x), cases_of(a), cases_of(b), rng.uniform(0.1, 1.0, (COUNT, POSES))


def hand_eye(_name, function):
    x, a, b, weights = hand_eye_cases()
    for name in LAYOUTS:
        for dtype in FLOATS:
            given = (of_each(cases.of(name, dtype), POSES) for cases in (a, b))
            found = function(*given, weights.astype(dtype))
            assert found.is_defined.all()
            # Two axes 30 degrees apart and angles of 17 degrees leave this many digits.
            agree_motions(found.transforms, name, getattr(x, name), 1 + x.size, rotation=16.0, steps=512)
            zero = np.zeros(COUNT)
            agree(found.angle, zero, 16.0, 512)
            agree(found.translation, zero, 16.0, 512)


# --- Means


@functools.cache
def pose_cases():
    """Motions [COUNT * POSES] within 0.7 radians of a middle, and weights."""
    rng = np.random.default_rng(303)
    count = COUNT * POSES
    middle = motions(303).exact.take(np.repeat(np.arange(COUNT), POSES))
    angle = np.minimum(angles(rng, count) / 4, 0.7)
    step = Motion(e.unit(exact(quaternions(rng, angle))), exact(rng.normal(size=(count, 3))))
    return cases_of(e.compose(middle, step)), rng.uniform(0.1, 1.0, (COUNT, POSES))


def weighted_logarithms(mean, poses, part):
    """Float64 [COUNT, 3] twice: the sum of the weighted logarithms from the mean to the poses."""
    count = poses.q.shape[1] // COUNT
    from_mean = e.inverse(mean.take(np.repeat(np.arange(COUNT), count)))
    twist = e.to_twist(e.compose(from_mean, poses))
    return [rounded((v.reshape(3, COUNT, count) * part.T[None]).sum(axis=2)) for v in twist]


def average(_name, function):
    poses, weights = pose_cases()
    part = shares(weights)
    size = of_each(poses.size, POSES).max(axis=1)
    first = function(of_each(poses.dual_quat, POSES), weights)
    residual = weighted_logarithms(motion_of(first.transforms, "dual_quat"), poses.exact, part)
    agree(residual[0], np.zeros((COUNT, 3)), 1.0)
    agree(residual[1], np.zeros((COUNT, 3)), size)
    means = cases_of(motion_of(first.transforms, "dual_quat"))
    for name in LAYOUTS:
        for dtype in FLOATS:
            found = function(of_each(poses.of(name, dtype), POSES), weights.astype(dtype))
            assert found.is_defined.all()
            assert (found.kept == 1).all()
            agree_motions(found.transforms, name, getattr(means, name), size)
    robust_average(function)


def robust_average(function):
    """Five poses near each other, and two outliers: these do not count, and the others' logarithms from
    the mean, weighted by Tukey's biweight, sum to 0."""
    rng = np.random.default_rng(304)
    near, off = 5, 2
    count = COUNT * (near + off)
    is_off = np.tile(np.arange(near + off) >= near, COUNT)
    middle = Motion(motions(304).exact.q, exact(rng.normal(size=(COUNT, 3))))
    angle = np.where(is_off, rng.uniform(0.8, 2.0, count), rng.uniform(0.005, 0.02, count))
    shift = directions(rng, count) * np.where(is_off, 5.0, rng.uniform(0.005, 0.02, count))[:, None]
    step = Motion(e.unit(exact(quaternions(rng, angle))), exact(shift))
    poses = e.compose(middle.take(np.repeat(np.arange(COUNT), near + off)), step)
    given = in_layout(poses, "dual_quat").reshape(COUNT, near + off, 8)
    found = function(given, robust=True)
    assert found.is_defined.all()
    assert not found.kept[:, near:].any()
    residual = weighted_logarithms(motion_of(found.transforms, "dual_quat"), poses, shares(found.kept))
    # The iteration ends when a step is below 1e-13.
    agree(residual[0], np.zeros((COUNT, 3)), 1.0, 1024)
    agree(residual[1], np.zeros((COUNT, 3)), 4.0, 1024)
    single = function(given.astype(np.float32), robust=True)
    assert single.is_defined.all()
    # The median may be that of another pose.
    agree(single.kept, found.kept, 1.0, 4096)
    agree_motions(single.transforms, "dual_quat", found.transforms, 4.0)


# Checks by module, function and method.
CHECKS = {
    "fit.rigid": rigid,
    "fit.hand_eye": hand_eye,
    "fit.average": average,
}
