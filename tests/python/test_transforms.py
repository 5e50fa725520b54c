# SPDX-License-Identifier: GPL-3.0-or-later
"""sinew.affine, .quat_vec and .dual_quat compared with scipy."""

import numpy as np
import pytest
import sinew
from hypothesis import given
from hypothesis import strategies as st
from motions import ANGLES, LAYOUTS, edge_motions, hat, layout, matrix, numbers, rigid, rigid_motions
from scipy.linalg import expm, logm
from scipy.spatial.transform import RigidTransform, Rotation

ALL = pytest.mark.parametrize("name", LAYOUTS)
BOTH = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def tolerance(dtype):
    return 64 * np.finfo(dtype).eps


def close(got, wanted, dtype=np.float64, factor=1.0):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=factor * tolerance(dtype))


def samples():
    return RigidTransform.concatenate([rigid(np.random.default_rng(0), 100), edge_motions()])


@ALL
@BOTH
def test_conversions_agree_with_scipy(name, dtype):
    motions = samples()
    array = layout(motions, name, dtype)
    for target in LAYOUTS:
        if target == name:
            continue
        result = getattr(LAYOUTS[name], f"to_{target}")(array)
        assert result.dtype == dtype
        assert result.shape == layout(motions, target).shape
        close(matrix(result, target), motions.as_matrix(), dtype)


@ALL
@BOTH
def test_compose_and_inverse_agree_with_scipy(name, dtype):
    module = LAYOUTS[name]
    a, b = samples()[:200], samples()[-200:]
    x, y = layout(a, name, dtype), layout(b, name, dtype)
    close(matrix(module.compose(x, y), name), (a * b).as_matrix(), dtype)
    close(matrix(module.inverse(x), name), a.inv().as_matrix(), dtype)
    assert module.compose(x, y).dtype == dtype


@ALL
@BOTH
def test_points_vectors_and_normals_agree_with_scipy(name, dtype):
    module, motions = LAYOUTS[name], samples()
    array = layout(motions, name, dtype)
    points = np.random.default_rng(1).uniform(-1, 1, (len(motions), 3)).astype(dtype)
    close(module.transform_point(array, points), motions.apply(points), dtype)
    close(module.transform_vector(array, points), motions.rotation.apply(points), dtype)
    normals = motions.rotation.apply(points)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    close(module.transform_normal(array, points), normals, dtype)


@ALL
@BOTH
def test_from_axis_angle_translation_and_rotation_matrix(name, dtype):
    module, rng = LAYOUTS[name], np.random.default_rng(2)
    axes = rng.normal(size=(len(ANGLES), 3)).astype(dtype)
    unit = axes / np.linalg.norm(axes.astype(np.float64), axis=1)[:, None]
    rotation = Rotation.from_rotvec(unit * np.array(ANGLES)[:, None])
    result = matrix(module.from_axis_angle(axes, np.array(ANGLES, dtype)), name)
    close(result[:, :3, :3], rotation.as_matrix(), dtype)
    close(result[:, :3, 3], 0.0)
    matrices = rotation.as_matrix().astype(dtype)
    close(matrix(module.from_rotation_matrix(matrices), name)[:, :3, :3], matrices, dtype)
    translated = matrix(module.from_translation(axes), name)
    np.testing.assert_array_equal(translated[:, :3, :3], np.tile(np.eye(3), (len(axes), 1, 1)))
    close(translated[:, :3, 3], axes, dtype)


@ALL
def test_identity(name):
    for dtype in (np.float32, np.float64):
        array = LAYOUTS[name].identity(dtype)
        assert array.dtype == dtype
        np.testing.assert_array_equal(matrix(array, name), np.eye(4))


@ALL
@BOTH
def test_twists_agree_with_scipy(name, dtype):
    module, motions = LAYOUTS[name], samples()
    twists = module.to_twist(layout(motions, name, dtype))
    # At 180 degrees either direction is right: the exponential must invert the logarithm.
    back = np.array([expm(hat(twist)) for twist in twists.astype(np.float64)])
    close(back, motions.as_matrix(), dtype, 2)
    close(matrix(module.from_twist(twists), name), motions.as_matrix(), dtype, 2)
    clear = motions.rotation.magnitude() < 3.1
    close(twists[clear], motions.as_exp_coords()[clear], dtype, 4)


def test_twist_is_the_matrix_logarithm():
    motions = rigid(np.random.default_rng(3), 30)
    for twist, one in zip(sinew.affine.to_twist(motions.as_matrix()), motions.as_matrix(), strict=True):
        close(hat(twist), logm(one).real, factor=1e3)  # logm is good to 1e-12 only


@ALL
@BOTH
def test_screw_and_back(name, dtype):
    module, motions = LAYOUTS[name], samples()
    screw = module.to_screw(layout(motions, name, dtype))
    assert all(part.dtype == dtype for part in screw)
    assert not np.isnan(screw.pitch).any()
    back = module.from_screw(screw.axis, screw.moment, screw.angle, screw.translation)
    close(matrix(back, name), motions.as_matrix(), dtype)
    close(np.linalg.norm(screw.axis, axis=1), 1.0, dtype)
    close(screw.angle, motions.rotation.magnitude(), dtype, 4)
    close((screw.axis * screw.moment).sum(axis=1) / (1 + np.linalg.norm(screw.moment, axis=1)), 0.0, dtype)


def test_screw_about_a_point_keeps_its_line():
    axis, point = np.array([1.0, 2.0, -3.0]), np.array([0.5, -1.0, 2.0])
    unit = axis / np.linalg.norm(axis)
    motion = sinew.dual_quat.from_screw_about(axis, point, np.array(ANGLES), 0.7)
    close(sinew.dual_quat.transform_point(motion, point), np.tile(point + 0.7 * unit, (len(ANGLES), 1)))
    rotated = sinew.dual_quat.to_screw(motion[-4])
    close(rotated.axis, unit)
    close(rotated.moment, np.cross(point, unit))
    close([rotated.angle, rotated.translation, rotated.pitch], [1.0, 0.7, 0.7])


@ALL
@BOTH
def test_rigid_distance_is_that_of_scipy(name, dtype):
    a, b = samples()[:200], samples()[-200:]
    apart = LAYOUTS[name].rigid_distance(layout(a, name, dtype), layout(b, name, dtype))
    close(apart.angle, (a.rotation.inv() * b.rotation).magnitude(), dtype, 4)
    close(apart.translation, np.linalg.norm(a.translation - b.translation, axis=1), dtype)


def test_normalized_matrix_is_the_nearest_rotation():
    rng = np.random.default_rng(4)
    matrices = np.tile(np.eye(4), (200, 1, 1))
    matrices[:, :3, :3] = rng.normal(size=(200, 3, 3))
    u, s, vt = np.linalg.svd(matrices[:, :3, :3])
    sign = np.linalg.det(u @ vt)
    assert (sign < 0).sum() > 50
    u[:, :, 2] *= sign[:, None]
    error = np.abs(sinew.affine.normalized(matrices)[:, :3, :3] - u @ vt).max(axis=(1, 2))
    assert (error * (s[:, 1] + sign * s[:, 2])).max() < 1e-13


def test_normalized_quaternions_are_unit():
    rng = np.random.default_rng(5)
    dual = sinew.dual_quat.normalized(rng.normal(size=(50, 8)))
    close((dual[:, :4] ** 2).sum(axis=1), 1.0)
    close((dual[:, :4] * dual[:, 4:]).sum(axis=1), 0.0)
    close(sinew.dual_quat.norm(dual), np.tile([1.0, 0.0], (50, 1)))
    pair = sinew.quat_vec.normalized(rng.normal(size=(50, 7)))
    close((pair[:, :4] ** 2).sum(axis=1), 1.0)
    np.testing.assert_array_equal(sinew.dual_quat.normalized(np.zeros(8)), sinew.dual_quat.identity())
    np.testing.assert_array_equal(sinew.quat_vec.normalized(np.zeros(7)), sinew.quat_vec.identity())


def test_affine_with_scale_and_shear():
    rng = np.random.default_rng(6)
    matrices = np.tile(np.eye(4), (50, 1, 1))
    matrices[:, :3] += rng.normal(size=(50, 3, 4))
    points = rng.normal(size=(50, 3))
    close(
        sinew.affine.transform_point(matrices, points),
        np.einsum("nij,nj->ni", matrices[:, :3, :3], points) + matrices[:, :3, 3],
    )
    condition = np.linalg.cond(matrices).max()
    close(sinew.affine.inverse(matrices), np.linalg.inv(matrices), factor=condition)
    normals = np.einsum("nji,nj->ni", np.linalg.inv(matrices[:, :3, :3]), points)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    close(sinew.affine.transform_normal(matrices, points), normals, factor=condition)


def test_log_exp_and_power_of_dual_quaternions():
    motions = samples()
    dual = layout(motions, "dual_quat")
    log = sinew.dual_quat.log(dual)
    np.testing.assert_array_equal(log[:, [0, 4]], 0.0)
    close(2 * log[:, [1, 2, 3, 5, 6, 7]], sinew.dual_quat.to_twist(dual))
    close(matrix(sinew.dual_quat.exp(log), "dual_quat"), motions.as_matrix())
    clear = motions[motions.rotation.magnitude() < 3.1]
    for exponent in (-1.0, 0.0, 0.3, 2.0):
        power = sinew.dual_quat.power(layout(clear, "dual_quat"), exponent)
        # Not RigidTransform ** exponent, which is good to 1e-8 only (scipy 1.17).
        wanted = [expm(exponent * hat(twist)) for twist in clear.as_exp_coords()]
        close(matrix(power, "dual_quat"), wanted, factor=4)


@given(rigid_motions(), rigid_motions(), rigid_motions())
def test_products_are_associative_in_every_layout(a, b, c):
    for name, module in LAYOUTS.items():
        x, y, z = (layout(motion, name) for motion in (a, b, c))
        grouped = module.compose(module.compose(x, y), z)
        close(grouped, module.compose(x, module.compose(y, z)))
        close(matrix(grouped, name), (a * b * c).as_matrix())


@given(rigid_motions())
def test_inverse_undoes_from_both_sides(a):
    for name, module in LAYOUTS.items():
        x = layout(a, name)
        close(matrix(module.compose(module.inverse(x), x), name), np.eye(4))
        close(matrix(module.compose(x, module.inverse(x)), name), np.eye(4))


@given(rigid_motions(), st.tuples(numbers(2.0), numbers(2.0), numbers(2.0)))
def test_both_quaternions_are_one_motion(a, point):
    for name, size in (("quat_vec", 4), ("dual_quat", 8)):
        module, x = LAYOUTS[name], layout(a, name)
        minus = x * np.where(np.arange(len(x)) < size, -1.0, 1.0)
        p = np.array(point)
        np.testing.assert_array_equal(module.transform_point(minus, p), module.transform_point(x, p))
        close(module.rigid_distance(minus, x), 0.0)
        if a.rotation.magnitude() < 3.14:
            close(module.to_twist(minus), module.to_twist(x))


@given(rigid_motions(), rigid_motions(), rigid_motions())
def test_rigid_distance_is_left_invariant(x, a, b):
    for name, module in LAYOUTS.items():
        plain = module.rigid_distance(layout(a, name), layout(b, name))
        moved = module.rigid_distance(layout(x * a, name), layout(x * b, name))
        close(moved, plain, factor=4)


@given(rigid_motions(), rigid_motions())
def test_conjugates_turn_products_round(a, b):
    dual = sinew.dual_quat
    x, y = layout(a, "dual_quat"), layout(b, "dual_quat")
    product = dual.compose(x, y)
    close(dual.conjugate(product), dual.compose(dual.conjugate(y), dual.conjugate(x)))
    close(dual.dual_conjugate(product), dual.compose(dual.dual_conjugate(x), dual.dual_conjugate(y)))
    combined = dual.compose(dual.combined_conjugate(y), dual.combined_conjugate(x))
    close(dual.combined_conjugate(product), combined)
    point = np.array([1.0, 0, 0, 0, 0, 0.3, -0.7, 1.1])
    moved = dual.compose(dual.compose(x, point), dual.combined_conjugate(x))
    close(moved, [1, 0, 0, 0, 0, *a.apply(point[5:])])
