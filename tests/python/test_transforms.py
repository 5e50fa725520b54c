# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects transforms of any size, exponentials of any angle, and what is refused as no rigid motion or no
dual number. exact_transforms.py has the oracles."""

import numpy as np
import pytest
import sinew
from scipy.spatial.transform import Rotation
from sinew import dual, quat

EPSILON = {np.float32: 1e-6, np.float64: 1e-14}


def close(got, wanted, tolerance=1e-14):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


def of(rotation):
    return rotation.as_quat(scalar_first=True)


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


def test_dual_numbers_without_a_result_are_refused():
    for call, argument in (
        (lambda: dual.divide([1, 2], [0, 1]), "b"),
        (lambda: dual.sqrt([0, 1]), "a"),
        (lambda: dual.log([-1, 1]), "a"),
    ):
        with pytest.raises(ValueError, match=f"^{argument}: expected"):
            call()


def test_identities_have_the_type_that_was_asked_for():
    for module in (sinew.affine, sinew.quat_vec, sinew.dual_quat):
        for dtype in (np.float32, np.float64):
            assert module.identity(dtype).dtype == dtype
            np.testing.assert_array_equal(
                module.normalized(0 * module.identity(dtype)), module.identity(dtype)
            )
