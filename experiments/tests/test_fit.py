# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects fits where points are degenerate, mirrored, huge or outliers. exact_fits.py has the oracles."""

import numpy as np
import pytest
import sinew
from future_work import fit
from motions import layout, matrix, rigid
from scipy.spatial.transform import RigidTransform, Rotation
from smith_2013 import fits

CASES = 2000


def random_pairs(rng, count, points=12, noise=0.05):
    """Points [count, points, 3], their images under rigid motions, and weights [count, points]."""
    # Thick, flat and thin sets, near the origin and away from it.
    extents = 10.0 ** rng.uniform(-2, 0, (count, 1, 3))
    source = rng.normal(size=(count, points, 3)) * extents + rng.uniform(-5, 5, (count, 1, 3))
    motions = rigid(rng, count)
    target = np.einsum("cij,cpj->cpi", motions.rotation.as_matrix(), source) + motions.translation[:, None]
    target += noise * extents.min(axis=2, keepdims=True) * rng.normal(size=target.shape)
    return source, target, rng.uniform(0.1, 2.0, (count, points))


def by_scipy(source, target, weights):
    """[4, 4]: Rotation.align_vectors about the weighted means."""
    middles = [np.average(points, axis=0, weights=weights) for points in (source, target)]
    rotation = Rotation.align_vectors(target - middles[1], source - middles[0], weights=weights)[0]
    return RigidTransform.from_components(middles[1] - rotation.apply(middles[0]), rotation).as_matrix()


def test_other_representations_give_the_same_fit():
    source, target, _ = random_pairs(np.random.default_rng(1), 200)
    want = matrix(fit.rigid(source, target).transforms, "quat_vec")
    np.testing.assert_allclose(fits.kabsch(source, target), want, rtol=0, atol=2e-8)
    np.testing.assert_allclose(matrix(fits.walker(source, target), "dual_quat"), want, rtol=0, atol=2e-8)


def test_directions_count_as_scipys_vectors():
    rng = np.random.default_rng(2)
    vectors = rng.normal(size=(200, 5, 3))
    rotations = Rotation.random(200, rng=rng)
    moved = np.einsum("cij,cpj->cpi", rotations.as_matrix(), vectors) + 0.1 * rng.normal(size=vectors.shape)
    unit = [array / np.linalg.norm(array, axis=2, keepdims=True) for array in (vectors, moved)]
    weights = rng.uniform(0.1, 2.0, (200, 5))
    result = fit.rigid(
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        source_directions=vectors,
        target_directions=3 * moved,
        direction_weights=weights,
    )
    assert result.is_defined.all()
    want = [
        Rotation.align_vectors(b, a, weights=w)[0].as_matrix() for a, b, w in zip(*unit, weights, strict=True)
    ]
    got = matrix(result.transforms, "quat_vec")
    np.testing.assert_allclose(got[:, :3, :3], want, rtol=0, atol=1e-12)
    assert (got[:, :3, 3] == 0).all()


def test_a_direction_is_what_a_line_of_points_lacks():
    motion = rigid(np.random.default_rng(3))
    line = np.array([4.0, 0, 0]) + np.outer(np.linspace(-1, 2, 7), [1.0, 2, -1])
    across = np.array([[0.0, 1, 2]])
    moved, turned = motion.apply(line), motion.rotation.apply(across)
    assert not fit.rigid(line, moved).is_defined
    result = fit.rigid(line, moved, source_directions=across, target_directions=turned)
    assert result.is_defined
    got = matrix(result.transforms, "quat_vec")
    np.testing.assert_allclose(got, motion.as_matrix(), rtol=0, atol=1e-13)
    assert result.error < 1e-14


def flat(rng):
    return rng.normal(size=(9, 3)) * [1, 2, 0]


# The input, whether the fit is unique, whether a mirror image would be better.
DEGENERATE = {
    "one point": (lambda rng: np.ones((1, 3)), 1, False, False),
    "one place": (lambda rng: np.full((5, 3), 0.1), 1, False, False),
    "a line": (lambda rng: rng.normal(size=(9, 1)) * [1.0, 2.0, 0.5] + 1, 1, False, False),
    "a plane": (flat, 1, True, False),
    "a plane, mirrored": (flat, [1, -1, 1], True, False),
    "a body, mirrored": (lambda rng: rng.normal(size=(9, 3)) * [1, 2, 3], [1, -1, 1], True, True),
    # Equal extents along y and z: a rotation by 180 degrees about any of many axes is equally good.
    "a cross, mirrored": (lambda rng: np.vstack([np.eye(3), -np.eye(3)]), [1, -1, 1], False, True),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("case", DEGENERATE)
def test_degenerate_points_are_flagged(case, dtype):
    make, mirror, is_defined, is_mirrored = DEGENERATE[case]
    rng = np.random.default_rng(4)
    motion = rigid(rng)
    source = make(rng)
    target = motion.apply(source * mirror)
    result = fit.rigid(source.astype(dtype), target.astype(dtype))
    assert result.is_defined == is_defined
    assert result.is_mirrored == is_mirrored
    got = matrix(result.transforms, "quat_vec")
    assert np.isfinite(got).all()
    np.testing.assert_allclose(np.linalg.det(got[:3, :3]), 1, atol=1e-5)
    off = source @ got[:3, :3].T + got[:3, 3] - target
    np.testing.assert_allclose(result.error, np.sqrt((off**2).sum(axis=1).mean()), atol=1e-5)
    if not is_mirrored:
        # One of the best fits: no error remains.
        assert np.abs(off).max() < (1e-5 if dtype == np.float32 else 1e-13)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_on_a_line_are_never_mirrored(dtype):
    """The determinant of their covariance is a rounding error of either sign."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        source = rng.normal(size=(rng.integers(2, 12), 1)) * rng.normal(size=3)
        source += rng.normal(size=3) * rng.choice([0, 1, 10])
        target = rigid(rng).apply(source)
        result = fit.rigid(source.astype(dtype), target.astype(dtype))
        assert not result.is_mirrored, seed
        assert not result.is_defined, seed


def test_mirrored_rods_are_mirror_images():
    for seed in range(100):
        rng = np.random.default_rng(seed)
        source = rng.normal(size=(9, 3)) * [1, 2e-3, 1e-3]
        target = rigid(rng).apply(source * [1, -1, 1])
        assert fit.rigid(source, target).is_mirrored, seed
        assert not fit.rigid(source, rigid(rng).apply(source)).is_mirrored, seed


def test_no_weight_gives_the_identity_and_weights_of_0_leave_points_out():
    rng = np.random.default_rng(5)
    source, target, weights = random_pairs(rng, 1, noise=0)
    for nothing in (fit.rigid(source[0], target[0], np.zeros(12)), fit.rigid(source[0, :0], target[0, :0])):
        assert not nothing.is_defined
        np.testing.assert_array_equal(matrix(nothing.transforms, "quat_vec"), np.eye(4))
    weights[0, :4] = 0
    target[0, :4] = 100
    part = fit.rigid(source[0], target[0], weights[0])
    want = by_scipy(source[0, 4:], target[0, 4:], weights[0, 4:])
    np.testing.assert_allclose(matrix(part.transforms, "quat_vec"), want, atol=1e-10)


@pytest.mark.parametrize(("size", "dtype"), [(1e-150, float), (1e150, float), (1e-30, "f4"), (1e30, "f4")])
def test_the_smallest_and_largest_coordinates(size, dtype):
    source, target, _ = random_pairs(np.random.default_rng(6), 1, noise=0)
    result = fit.rigid((size * source[0]).astype(dtype), (size * target[0]).astype(dtype))
    got = matrix(result.transforms, "quat_vec")
    want = by_scipy(source[0], target[0], np.ones(12))
    got[:3, 3] /= size
    assert result.is_defined
    np.testing.assert_allclose(got, want, atol=1e-3 if dtype == "f4" else 1e-9)


def hand_eye_reference(a, b):
    """Daniilidis 1999, eqs. 31 to 36: x as [8] from dual quaternions [n, 8]."""

    def cross(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    rows = []
    for p, q in zip(a, b, strict=True):
        p, q = p * np.sign(p[0]), q * np.sign(q[0])
        real = np.column_stack([p[1:4] - q[1:4], cross(p[1:4] + q[1:4])])
        dual = np.column_stack([p[5:] - q[5:], cross(p[5:] + q[5:])])
        rows += [np.hstack([real, np.zeros((3, 4))]), np.hstack([dual, real])]
    v7, v8 = np.linalg.svd(np.vstack(rows))[2][6:]
    roots = np.roots([v7[:4] @ v7[4:], v7[:4] @ v8[4:] + v8[:4] @ v7[4:], v8[:4] @ v8[4:]]).real
    found = max((s * v7 + v8 for s in roots), key=lambda v: np.linalg.norm(v[:4]) / np.linalg.norm(v))
    return found / np.linalg.norm(found[:4]) * np.sign(found[0])


def motions_of_two(rng, count, motions, noise=0.0):
    """Motions of one body, those of the other, and x: a x = x b up to noise."""
    x = rigid(rng, count)
    a = [rigid(rng, count) for _ in range(motions)]
    b = [x.inv() * each * x for each in a]
    if noise:
        twists = rng.normal(size=(motions, count, 6)) * noise
        b = [each * RigidTransform.from_exp_coords(t) for each, t in zip(b, twists, strict=True)]
    stacked = [np.stack([layout(each, "dual_quat") for each in of], axis=1) for of in (a, b)]
    return *stacked, x


def test_hand_eye_of_noisy_motions_is_that_of_the_paper():
    a, b, _ = motions_of_two(np.random.default_rng(9), 200, 8, noise=0.01)
    for i in range(200):
        # Rotations by 180 degrees have signs that noise decides, which the formulas do not determine.
        clear = (np.abs(a[i, :, 0]) > 0.05) & (np.abs(b[i, :, 0]) > 0.05)
        p, q = a[i, clear], b[i, clear]
        # The paper's rows depend on the unit of length; Sinew's do not.
        longest = max(np.linalg.norm(sinew.dual_quat.to_quat_vec(e)[:, 4:], axis=1).max() for e in (p, q))
        scale = np.repeat([1, 1 / longest], 4)
        want = hand_eye_reference(p * scale, q * scale) / scale
        got = matrix(fit.hand_eye(p, q).transforms, "dual_quat")
        rotation = matrix(want, "dual_quat")[:3, :3]
        np.testing.assert_allclose(got[:3, :3], rotation, atol=1e-11)
        # The paper's translation does not minimise the remaining squares; Sinew's does.
        a_motions, b_motions = matrix(p, "dual_quat"), matrix(q, "dual_quat")
        rows = np.vstack(a_motions[:, :3, :3] - np.eye(3))
        right = np.concatenate(b_motions[:, :3, 3] @ rotation.T - a_motions[:, :3, 3])
        np.testing.assert_allclose(got[:3, 3], np.linalg.lstsq(rows, right, rcond=None)[0], atol=1e-10)


def test_hand_eye_of_parallel_axes_is_not_defined():
    rng = np.random.default_rng(11)
    x = rigid(rng)

    def solve(rotvecs, dtype=float):
        a = RigidTransform.from_components(rng.normal(size=(len(rotvecs), 3)), Rotation.from_rotvec(rotvecs))
        b = RigidTransform.concatenate([x.inv() * each * x for each in a])
        return fit.hand_eye(layout(a, "dual_quat", dtype), layout(b, "dual_quat", dtype))

    for dtype in (np.float32, np.float64):
        assert not solve([[0.3, 1, 0]], dtype).is_defined
        assert not solve([[0.3, 1, 0], [-0.6, -2, 0], [0.15, 0.5, 0]], dtype).is_defined
        assert not solve([[0, 0, 0], [0, 0, 0]], dtype).is_defined
        assert not solve([[np.pi, 0, 0], [0, np.pi, 0]], dtype).is_defined
    both = solve([[0.3, 1, 0], [1, 0, 0.2], [np.pi, 0, 0]])
    assert both.is_defined
    np.testing.assert_allclose(matrix(both.transforms, "dual_quat"), x.as_matrix(), atol=1e-12)
    a = layout(rigid(rng, 3), "dual_quat")
    assert not fit.hand_eye(a, a, np.zeros(3)).is_defined


@pytest.mark.parametrize("robust", [False, True])
def test_averages_that_are_not_unique_are_not_defined(robust):
    turns = RigidTransform.from_rotation(Rotation.from_euler("z", [[0], [120], [240]], degrees=True))
    for name in ("affine", "quat_vec", "dual_quat"):
        result = fit.average(layout(turns, name), robust=robust)
        assert not result.is_defined
        assert np.isfinite(result.transforms).all()
        one = fit.average(layout(turns[:1], name), robust=robust)
        assert one.is_defined
        np.testing.assert_allclose(matrix(one.transforms, name), np.eye(4), atol=1e-15)
        assert not fit.average(layout(turns, name), np.zeros(3), robust=robust).is_defined


def test_robust_average_of_equal_poses_is_that_pose():
    rng = np.random.default_rng(14)
    right = layout(rigid(rng), "affine")
    poses = np.concatenate([layout(rigid(rng, 4), "affine"), np.repeat(right[None], 5, axis=0)])
    result = fit.average(poses, robust=True)
    assert result.is_defined
    np.testing.assert_allclose(result.transforms, right, atol=1e-14)
    np.testing.assert_array_equal(result.kept > 0.99, [False] * 4 + [True] * 5)
    # Weights decide which half counts.
    weights = np.array([1.0] * 4 + [0.1] * 5)
    assert not np.allclose(fit.average(poses, weights, robust=True).transforms, right)
