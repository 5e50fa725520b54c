# SPDX-License-Identifier: GPL-3.0-or-later
"""sinew.quat and sinew.dual, the parts of transforms, compared with scipy and derivatives."""

import numpy as np
import pytest
import sinew
from scipy.spatial.transform import Rotation, Slerp
from sinew import dual, quat

EPSILON = {np.float32: 1e-6, np.float64: 1e-14}
TYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def close(got, wanted, tolerance=1e-14):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


def of(rotation):
    return rotation.as_quat(scalar_first=True)


def same_rotation(got, wanted, tolerance):
    """Quaternions of either sign."""
    close(np.abs((np.asarray(got, float) * wanted).sum(axis=-1)), 1, tolerance)
    close(np.linalg.norm(got, axis=-1), 1, tolerance)


@TYPES
def test_quaternions_are_scipys(dtype):
    rng = np.random.default_rng(0)
    a, b = Rotation.random(2000, rng=rng), Rotation.random(2000, rng=rng)
    p, q = of(a).astype(dtype), of(b).astype(dtype)
    vectors = rng.normal(size=(2000, 3)).astype(dtype)
    small = EPSILON[dtype]
    same_rotation(quat.compose(p, q), of(a * b), 4 * small)
    close(quat.rotate(p, vectors), a.apply(vectors), 8 * small)
    close(quat.to_rotation_matrix(p), a.as_matrix(), 4 * small)
    same_rotation(quat.from_rotation_matrix(a.as_matrix().astype(dtype)), of(a), 4 * small)
    same_rotation(quat.from_rotation_vector(a.as_rotvec().astype(dtype)), of(a), 4 * small)
    close(Rotation.from_rotvec(quat.to_rotation_vector(p)).as_matrix(), a.as_matrix(), 8 * small)
    close(quat.angle_between(p, q), (a.inv() * b).magnitude(), 8 * small)
    close(quat.rotate(quat.conjugate(p), quat.rotate(p, vectors)), vectors, 8 * small)
    axes = a.as_rotvec() / a.magnitude()[:, None]
    same_rotation(
        quat.from_axis_angle((3 * axes).astype(dtype), a.magnitude().astype(dtype)), of(a), 4 * small
    )
    assert quat.compose(p, q).dtype == dtype


def test_slerp_takes_many_times_and_the_shorter_way():
    a, b = Rotation.random(2, rng=np.random.default_rng(1))
    t = np.linspace(0, 1, 7)
    want = of(Slerp([0, 1], Rotation.concatenate([a, b]))(t))
    same_rotation(quat.slerp(of(a), of(b), t), want, 1e-14)
    same_rotation(quat.slerp(of(a), -of(b), t), want, 1e-14)


@pytest.mark.parametrize("size", [1e-300, 1e-30, 1.0, 1e20, 1e200])
def test_lengths_of_any_size(size):
    q = of(Rotation.random(rng=np.random.default_rng(2)))
    pair, pose = np.append(q, [1, 2, 3]), sinew.quat_vec.to_dual_quat(np.append(q, [1, 2, 3]))
    types = [np.float64] + [np.float32] * (1e-35 < size < 1e35)
    for dtype in types:
        scaled, small = (size * q).astype(dtype), EPSILON[dtype]
        close(quat.normalized(scaled), q, small)
        np.testing.assert_allclose(quat.norm(scaled), size, rtol=small)
        close(sinew.quat_vec.normalized(np.append(scaled, [1, 2, 3]).astype(dtype)), pair, small)
        close(sinew.dual_quat.normalized((size * pose).astype(dtype)), pose, 4 * small)
        np.testing.assert_allclose(sinew.dual_quat.norm((size * pose).astype(dtype))[0], size, rtol=small)
    assert (quat.normalized(np.zeros(4)) == [1, 0, 0, 0]).all()


def test_three_numbers_store_a_rotation():
    q = of(Rotation.random(2000, rng=np.random.default_rng(3)))
    stored = quat.to_three_numbers(q)
    assert stored.shape == (2000, 3)
    # w loses the digits that 1 - |v|^2 loses: the smaller w is, the more.
    error = np.abs(quat.from_three_numbers(stored) - np.where(q[:, :1] < 0, -q, q)).max(axis=1)
    assert (error <= 1e-15 / np.maximum(np.abs(q[:, 0]), 1e-8)).all()
    half_turn = quat.from_three_numbers(np.array([1, 1e-3, 0], np.float32))
    close(np.linalg.norm(half_turn), 1, 1e-6)


@pytest.mark.parametrize(("dtype", "angle"), [(np.float32, 1e15), (np.float64, 1e150)])
def test_exponentials_of_any_angle_are_finite(dtype, angle):
    twist = np.array([0, angle, 0, 1, 2, 3], dtype)
    for layout in (sinew.affine, sinew.quat_vec, sinew.dual_quat):
        assert np.isfinite(layout.from_twist(twist)).all()
    # Equal along the axis, and nearly equal across it.
    close(sinew.quat_vec.from_twist(twist)[4:], [0, 2, 0], 1e-6)
    # The formula for large angles continues where the other one ends.
    below, above = (sinew.quat_vec.from_twist([0, a, 0, 1, 2, 3.0]) for a in (1e4, np.nextafter(1e4, 2e4)))
    close(below, above, 1e-11)


def test_matrices_that_are_not_rigid_are_refused():
    mirror = np.diag([-1.0, 1, 1, 1])
    shear = np.eye(4)
    shear[0, 1] = 0.1
    for a in (mirror, shear, 2 * np.eye(4)):
        for name in ("to_quat_vec", "to_dual_quat", "to_screw", "to_twist"):
            with pytest.raises(ValueError, match=r"^a: expected rigid"):
                getattr(sinew.affine, name)(a)
        with pytest.raises(ValueError, match=r"^b: expected rigid"):
            sinew.affine.rigid_distance(np.eye(4), a)
        for module in (sinew.quat, sinew.quat_vec, sinew.dual_quat):
            with pytest.raises(ValueError, match=r"^rotation: expected rigid"):
                module.from_rotation_matrix(a[:3, :3])
    # Rounding by float32 and by some products is accepted.
    turned = sinew.affine.from_axis_angle([1, 2, 3], 1.0).astype(np.float32)
    turned[0] *= np.float32(1.0002)
    sinew.affine.to_quat_vec(turned)


def test_dual_numbers_are_values_and_derivatives():
    x = np.random.default_rng(4).uniform(0.2, 3, 2000)
    step = 1e-6
    a = np.stack([x, np.full_like(x, 2.0)], axis=-1)
    for name in ("sin", "cos", "exp", "log", "sqrt"):
        got, function = getattr(dual, name)(a), getattr(np, name)
        close(got[:, 0], function(x), 1e-13)
        np.testing.assert_allclose(
            got[:, 1], (function(x + step) - function(x - step)) / step, rtol=1e-8, atol=1e-9
        )
    np.testing.assert_array_equal(dual.multiply([2, 3], [5, 7]), [10, 29])
    close(dual.multiply(dual.divide(a, [5, 7]), [5, 7]), a, 1e-14)
    np.testing.assert_array_equal(dual.conjugate([2.0, 3]), [2, -3])
    for call, argument in (
        (lambda: dual.divide([1, 2], [0, 1]), "b"),
        (lambda: dual.sqrt([0, 1]), "a"),
        (lambda: dual.log([-1, 1]), "a"),
    ):
        with pytest.raises(ValueError, match=f"^{argument}: expected"):
            call()
