# SPDX-License-Identifier: GPL-3.0-or-later
"""Seeded cases for the oracle with 50 digits, including edge cases, and criteria of equality."""

import functools
from typing import NamedTuple

import numpy as np
import sinew
from exact import Motion, dual_part, exact, matrix, of_dual, product, rotate, rounded, unit

COUNT = 2000
FLOATS = (np.float64, np.float32)
LAYOUTS = {"affine": sinew.affine, "quat_vec": sinew.quat_vec, "dual_quat": sinew.dual_quat}

# The allowed error, in steps of the type at the size of what is summed: 1.4e-14 in float64, 7.6e-6 in
# float32. Checks that allow more say why.
STEPS = 64


class Cases(NamedTuple):
    """COUNT rigid motions: exact, and rounded to float64 in each layout. size: [n] of their translations."""

    exact: Motion
    affine: np.ndarray
    quat_vec: np.ndarray
    dual_quat: np.ndarray
    size: np.ndarray

    def of(self, layout, dtype):
        return getattr(self, layout).astype(dtype)


def cases_of(motion):
    layouts = [in_layout(motion, name) for name in LAYOUTS]
    return Cases(motion, *layouts, np.linalg.norm(rounded(motion.t), axis=-1))


def in_layout(motion, name):
    """The motions as float64 [n, 4, 4], [n, 7] or [n, 8]."""
    if name == "quat_vec":
        return rounded(np.concatenate([motion.q, motion.t]))
    if name == "dual_quat":
        return rounded(np.concatenate([motion.q, dual_part(motion)]))
    result = np.zeros((*motion.q.shape[1:], 4, 4))
    result[..., :3, :3] = np.moveaxis(matrix(motion.q).astype(np.float64), (0, 1), (-2, -1))
    result[..., :3, 3] = rounded(motion.t)
    result[..., 3, 3] = 1.0
    return result


def motion_of(array, name):
    """The exact motions of quaternion-vector pairs or dual quaternions, with rotations of unit length."""
    numbers = exact(array)
    return Motion(unit(numbers[:4]), numbers[4:]) if name == "quat_vec" else of_dual(numbers[:4], numbers[4:])


def of_each(array, count):
    """[COUNT, count, ..]"""
    return array.reshape(COUNT, count, *array.shape[1:])


def shares(weights):
    """Weights [n, k] as numbers [k, n] of sum 1."""
    number = exact(weights)
    return number / number.sum(axis=0)


def nearest_rotations(arrays):
    """float64 [n, 4, 4] with the nearest rotations, the largest singular values, and the gap to the next
    nearest rotations."""
    u, s, vt = np.linalg.svd(arrays[:, :3, :3])
    sign = np.linalg.det(u @ vt)
    u[:, :, 2] *= sign[:, None]
    result = arrays.copy()
    result[:, :3, :3] = u @ vt
    return result, s[:, 0], s[:, 1] + sign * s[:, 2]


# --- Families, arranged so that each family of rotations is combined with each of translations.


def directions(rng, count=COUNT):
    v = rng.normal(size=(count, 3))
    # Every fifth along an axis.
    v[::5] = np.eye(3)[rng.integers(0, 3, len(v[::5]))] * rng.choice([-1.0, 1.0], (len(v[::5]), 1))
    return v / np.linalg.norm(v, axis=1)[:, None]


def angles(rng, count=COUNT):
    """Angles: any, near 0, 0, near 180 degrees, 180 degrees; also the last bits at both edges."""
    angle = rng.uniform(0.0, np.pi, count)
    tiny = 10.0 ** rng.uniform(-12, -1, count)
    family = np.arange(count) % 8
    angle = np.where(family == 1, tiny, angle)
    angle = np.where(family == 2, np.pi - tiny, angle)
    angle = np.where(family == 3, rng.choice([0.0, np.pi], count), angle)
    return np.where(family == 4, rng.choice([0.5, 1 / 3, 2 / 3], count) * np.pi, angle)


def translations(rng, count=COUNT):
    """Lengths: any, 0, tiny, huge."""
    t = rng.normal(size=(count, 3)) * 3.0
    family = (np.arange(count) // 8) % 5
    power = np.where(family == 1, rng.uniform(-25, -5, count), 0.0)
    power = np.where(family == 2, rng.uniform(4, 12, count), power)
    return t * (10.0**power * (family != 3))[:, None]


def quaternions(rng, angle):
    """Unit quaternions, float64 [n, 4], of either sign; w = 0 at 180 degrees."""
    half = np.where(angle == np.pi, 0.0, np.cos(angle / 2))
    q = np.column_stack([half, np.sin(angle / 2)[:, None] * directions(rng, len(angle))])
    return q / np.linalg.norm(q, axis=1)[:, None] * rng.choice([-1.0, 1.0], (len(angle), 1))


@functools.cache
def motions(seed):
    """Cases of any kind."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(COUNT)
    q, t = quaternions(rng, angles(rng)), translations(rng)
    # Another seed gives another order, so that families of two are combined.
    return cases_of(Motion(unit(exact(q[order])), exact(t[order])))


@functools.cache
def pairs(seed):
    """Two Cases, the second rotated from the first by the families' angles, some of them near 180
    degrees."""
    first = motions(seed)
    rng = np.random.default_rng(seed + 1000)
    step = Motion(unit(exact(quaternions(rng, angles(rng)))), exact(translations(rng)))
    second = Motion(product(first.exact.q, step.q), rotate(first.exact.q, step.t) + first.exact.t)
    return first, cases_of(second)


def points(seed):
    """float64 [n, 3]."""
    return translations(np.random.default_rng(seed + 2000))[::-1].copy()


def linear_maps(seed):
    """Matrices float64 [n, 4, 4] that rotate, scale by 0.1 to 10 along axes, shear and mirror."""
    rng = np.random.default_rng(seed + 3000)
    left, right = motions(seed).affine[:, :3, :3], motions(seed + 1).affine[:, :3, :3]
    scale = 10.0 ** rng.uniform(-1, 1, (COUNT, 3)) * rng.choice([-1.0, 1.0], (COUNT, 3))
    result = np.tile(np.eye(4), (COUNT, 1, 1))
    result[:, :3, :3] = np.einsum("nij,nj,nkj->nik", left, scale, right)
    result[:, :3, 3] = points(seed)
    return result


def exact_matrix(linear):
    """float64 [n, 3, 3] as numbers [3, 3, n]."""
    return exact(linear.reshape(*linear.shape[:-2], 9)).reshape(3, 3, *linear.shape[:-2])


# --- Criteria of equality


def step_of(dtype):
    return float(np.finfo(dtype).eps)


def largest(array):
    """[n]: of each case."""
    return np.abs(np.asarray(array, np.float64)).reshape(len(array), -1).max(axis=1)


def agree(got, want, size, steps=STEPS, where=None, count=COUNT):
    """Asserts that `got` [n, ..] equals `want`, float64 [n, ..], within `steps` of its type at `size`,
    [n] or a number, where `where` is true."""
    assert len(got) == len(want) == count, (len(got), len(want))
    assert np.isfinite(got).all(), f"case {np.argmin(np.isfinite(largest(got)))} is not finite"
    off = largest(got.astype(np.float64) - want)
    allowed = steps * step_of(got.dtype) * np.broadcast_to(size, off.shape) + np.finfo(got.dtype).tiny
    ratio = np.where(True if where is None else where, off / allowed, 0.0)
    worst = int(np.argmax(ratio))
    assert ratio[worst] <= 1.0, (
        f"{got.dtype}, case {worst}: {got[worst]} instead of {want[worst]}, off by "
        f"{ratio[worst] * steps:.3g} steps, {steps} allowed; {int((ratio > 1).sum())} cases"
    )


def agree_motions(got, name, want, size, *, rotation=1.0, steps=STEPS, where=None, signed=False):
    """Asserts that `got`, in the layout `name`, equals `want`, float64 in that layout.

    size      [n] of the translations that are summed
    rotation  what errors of rotations are relative to, [n] or a number
    signed    whether the signs of quaternions matter
    """
    got = got.reshape(COUNT, *want.shape[1:])
    rotations = got[:, :3, :3] if name == "affine" else got[:, :4]
    of_rotations = want[:, :3, :3] if name == "affine" else want[:, :4]
    rest = got[:, :3, 3] if name == "affine" else got[:, 4:]
    of_rest = want[:, :3, 3] if name == "affine" else want[:, 4:]
    if name == "affine":
        np.testing.assert_array_equal(got[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (COUNT, 1)))
    elif not signed:
        sign = np.where(np.einsum("ni,ni->n", rotations.astype(np.float64), of_rotations) < 0, -1.0, 1.0)
        of_rotations = of_rotations * sign[:, None]
        if name == "dual_quat":
            of_rest = of_rest * sign[:, None]
    agree(rotations, of_rotations, rotation, steps, where)
    agree(rest, of_rest, size, steps, where)
