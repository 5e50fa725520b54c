# SPDX-License-Identifier: GPL-3.0-or-later
"""sinew.interpolate compared with scipy and with float64 code written from the papers."""

import numpy as np
import pytest
import sinew
from hypothesis import assume, given
from hypothesis import strategies as st
from motions import LAYOUT_OF, LAYOUTS, hat, layout, matrix, rigid, rigid_motions
from scipy.linalg import expm
from scipy.spatial.transform import RigidTransform, Rotation, Slerp
from sinew.interpolate import METHODS, between, blend

ALL = pytest.mark.parametrize("method", METHODS)
TIMES = [0.0, 0.1, 0.5, 0.8, 1.0]


def close(got, wanted, tolerance=1e-13):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


def nearest_rotation(linear):
    u, _, vt = np.linalg.svd(linear)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def one_side(quaternions, weights):
    pivot = quaternions[np.argmax(weights)]
    return quaternions * np.where(quaternions @ pivot < 0, -1.0, 1.0)[:, None]


def mean_rotation(rotations, weights):
    """The fixed point: the weighted logarithms from it to the rotations sum to 0."""
    quaternions = one_side(rotations.as_quat(), weights)
    mean = Rotation.from_quat(weights @ quaternions)
    for _ in range(60):
        step = weights @ (mean.inv() * rotations).as_rotvec()
        mean = mean * Rotation.from_rotvec(step)
        if np.abs(step).max() < 1e-14:
            break
    return mean


def mean_motion(motions, weights):
    start = one_side(motions.as_dual_quat()[:, :4], weights)  # scalar last: x, y, z, w, then the dual part
    signs = np.where((start * motions.as_dual_quat()[:, :4]).sum(axis=1) < 0, -1.0, 1.0)
    mean = RigidTransform.from_dual_quat((signs * weights) @ motions.as_dual_quat())
    for _ in range(60):
        step = weights @ (mean.inv() * motions).as_exp_coords()
        mean = mean * RigidTransform.from_exp_coords(step)
        if np.abs(step).max() < 1e-14:
            break
    return mean


def expected(method, motions, weights):
    """float64 [4, 4] of the blend, from the papers."""
    matrices = motions.as_matrix()
    result = np.tensordot(weights, matrices, axes=1)
    if method == "matrix_polar":
        result[:3, :3] = nearest_rotation(result[:3, :3])
    elif method == "matrix_log":
        result = expm(hat(weights @ motions.as_exp_coords()))
    elif method == "qv_nlerp":
        quaternions = one_side(motions.rotation.as_quat(), weights)
        result[:3, :3] = Rotation.from_quat(weights @ quaternions).as_matrix()
    elif method == "qv_slerp":
        result[:3, :3] = mean_rotation(motions.rotation, weights).as_matrix()
    elif method == "dlb":
        dual = motions.as_dual_quat(scalar_first=True)
        signs = np.where(dual[:, :4] @ dual[np.argmax(weights), :4] < 0, -1.0, 1.0)
        result = RigidTransform.from_dual_quat((signs * weights) @ dual, scalar_first=True).as_matrix()
    elif method in ("sclerp", "dib"):
        result = mean_motion(motions, weights).as_matrix()
    return result


@ALL
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_between_agrees_with_the_papers(method, dtype):
    rng = np.random.default_rng(0)
    name = LAYOUT_OF[method]
    for _ in range(20):
        ends = rigid(rng, 2)
        a, b = layout(ends, name, dtype)
        result = between(a, b, np.array(TIMES, dtype), method)
        assert result.transforms.dtype == dtype
        assert result.is_defined.all()
        for t, transform in zip(TIMES, result.transforms, strict=True):
            # Almost 180 degrees apart, the rounding of float32 changes the result.
            far = (
                ends[0].inv() * ends[1]
            ).rotation.magnitude() > 3.1 or ends.rotation.magnitude().max() > 3.1
            tolerance = 1e-12 if dtype == np.float64 else 1e-3 if far else 3e-5
            want = expected(method, ends, np.array([1 - t, t]))
            close(matrix(transform, name), want, tolerance)


@ALL
def test_blend_of_many_agrees_with_the_papers(method):
    rng = np.random.default_rng(1)
    name = LAYOUT_OF[method]
    for count in (1, 2, 3, 5, 8):
        for _ in range(8):
            # Within 115 degrees of each other, the mean on the sphere is unique nearby.
            middle = rigid(rng)
            spread = RigidTransform.from_exp_coords(
                np.column_stack([rng.uniform(-1, 1, (count, 3)) / 1.8, rng.uniform(-2, 2, (count, 3))])
            )
            motions = middle * spread
            weights = rng.uniform(0.05, 1.0, count)
            result = blend(layout(motions, name), 3 * weights, method)
            assert result.is_defined
            close(matrix(result.transforms, name), expected(method, motions, weights / weights.sum()), 1e-12)


def test_qv_slerp_is_scipys_slerp_and_sclerp_its_screw():
    rng = np.random.default_rng(2)
    for _ in range(20):
        ends = rigid(rng, 2)
        rotation = Slerp([0, 1], ends.rotation)(TIMES).as_matrix()
        pair = layout(ends, "quat_vec")
        slerp = matrix(between(pair[0], pair[1], np.array(TIMES), "qv_slerp").transforms, "quat_vec")
        close(slerp[:, :3, :3], rotation)
        dual = layout(ends, "dual_quat")
        screw = matrix(between(dual[0], dual[1], np.array(TIMES), "sclerp").transforms, "dual_quat")
        close(screw[:, :3, :3], rotation)
        for t, got in zip(TIMES, screw, strict=True):
            screw_part = expm(t * hat((ends[0].inv() * ends[1]).as_exp_coords()))
            close(got, ends[0].as_matrix() @ screw_part)


@ALL
def test_broadcasts_one_against_many(method):
    name = LAYOUT_OF[method]
    motions = layout(rigid(np.random.default_rng(3), 6), name)
    table = motions.reshape(2, 3, *motions.shape[1:])
    t = np.array([0.2, 0.5, 0.9])
    result = between(motions[0], table, t, method)
    assert result.transforms.shape == table.shape
    assert result.is_defined.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            one = between(motions[0], table[i, j], float(t[j]), method)
            np.testing.assert_array_equal(result.transforms[i, j], one.transforms)
            assert one.is_defined.shape == ()
    weights = np.array([[0.2, 0.3, 0.5], [0.1, 0.1, 0.8], [1.0, 0.0, 0.0], [0.4, 0.4, 0.2]])
    blends = blend(table[:, None], weights, method)
    assert blends.is_defined.shape == (2, 4)
    np.testing.assert_array_equal(blends.transforms[1, 2], blend(table[1], weights[2], method).transforms)


# Input without a unique result: the result is finite and marked as not defined.
@ALL
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_not_defined_is_said_and_finite(method, dtype):
    name = LAYOUT_OF[method]
    half_turns = RigidTransform.from_components(
        [[0, 0, 0], [1, 2, 3], [1, 2, 3]],
        Rotation.from_rotvec(np.pi * np.array([[0, 0, 0], [1, 0, 0], [0, 0.6, 0.8]])),
    )
    array = layout(half_turns, name, dtype)
    defined = method == "matrix_linear"
    middle = between(array[0], array[1:], 0.5, method)
    assert np.isfinite(middle.transforms).all()
    assert (middle.is_defined == defined).all()
    assert between(array[0], array[1], np.array([0, 1], dtype), method).is_defined.all()
    many = blend(array, np.array([0.0, 0.5, 0.5], dtype), method)
    assert np.isfinite(many.transforms).all()
    nothing = blend(array, np.zeros(3, dtype), method)
    np.testing.assert_array_equal(matrix(nothing.transforms, name), matrix(array[0], name))
    assert not nothing.is_defined


def in_space(method, ends, t, left, right):
    """[4, 4] of left^-1 between(left a right, left b right) right^-1: between(a, b) if it is invariant."""
    name = LAYOUT_OF[method]
    moved = left * ends * right
    result = between(*layout(moved, name), t, method)
    return left.inv().as_matrix() @ matrix(result.transforms, name) @ right.inv().as_matrix()


BELOW_180_DEGREES = rigid_motions(angle=1.5)
PARTS = st.floats(0.0, 1.0)


@pytest.mark.parametrize("method", ["dlb", "sclerp", "dib", "matrix_linear"])
@given(a=BELOW_180_DEGREES, b=BELOW_180_DEGREES, left=rigid_motions(), right=rigid_motions(), t=PARTS)
def test_independent_of_coordinates_on_both_sides(method, a, b, left, right, t):
    ends = RigidTransform.concatenate([a, b])
    plain = matrix(between(*layout(ends, LAYOUT_OF[method]), t, method).transforms, LAYOUT_OF[method])
    close(in_space(method, ends, t, left, right), plain, 1e-12)


@pytest.mark.parametrize("method", ["qv_nlerp", "qv_slerp", "matrix_polar"])
@given(a=BELOW_180_DEGREES, b=BELOW_180_DEGREES, left=rigid_motions(), t=PARTS)
def test_independent_of_coordinates_on_the_left(method, a, b, left, t):
    ends = RigidTransform.concatenate([a, b])
    plain = matrix(between(*layout(ends, LAYOUT_OF[method]), t, method).transforms, LAYOUT_OF[method])
    close(in_space(method, ends, t, left, RigidTransform.identity()), plain, 1e-12)


@given(a=BELOW_180_DEGREES, b=BELOW_180_DEGREES, change=rigid_motions(), t=PARTS)
def test_matrix_log_is_independent_of_a_change_of_coordinates(a, b, change, t):
    ends = RigidTransform.concatenate([a, b])
    plain = matrix(between(*layout(ends, "affine"), t, "matrix_log").transforms, "affine")
    close(in_space("matrix_log", ends, t, change, change.inv()), plain, 1e-12)


def test_matrix_log_depends_on_what_the_identity_is():
    ends = RigidTransform.from_rotation(Rotation.from_euler("z", [[0], [90]], degrees=True))
    plain = matrix(between(*layout(ends, "affine"), 0.25, "matrix_log").transforms, "affine")
    left = RigidTransform.from_rotation(Rotation.from_euler("x", 90, degrees=True))
    moved = in_space("matrix_log", ends, 0.25, left, RigidTransform.identity())
    assert np.abs(moved - plain).max() > 0.05


# Smith 2013, section 3.5.2: the translation of a pair interpolated after a change of the origin differs by
# (1-t) q1 v q1* + t q2 v q2* - q(t) v q(t)*.
@pytest.mark.parametrize("method", ["qv_nlerp", "qv_slerp"])
@given(a=BELOW_180_DEGREES, b=BELOW_180_DEGREES, right=rigid_motions(), t=PARTS)
def test_pairs_depend_on_the_origin_as_the_report_says(method, a, b, right, t):
    ends = RigidTransform.concatenate([a, b])
    plain = matrix(between(*layout(ends, "quat_vec"), t, method).transforms, "quat_vec")
    moved = in_space(method, ends, t, RigidTransform.identity(), right) @ right.as_matrix()
    difference = moved[:3, 3] - (plain @ right.as_matrix())[:3, 3]
    v = right.translation
    rotated = (1 - t) * a.rotation.apply(v) + t * b.rotation.apply(v)
    close(difference, rotated - plain[:3, :3] @ v, 1e-12)


def test_pairs_fail_where_dual_quaternions_hold():
    a = RigidTransform.identity()
    b = RigidTransform.from_rotation(Rotation.from_euler("z", 90, degrees=True))
    right = RigidTransform.from_translation([1.0, 0, 0])
    ends = RigidTransform.concatenate([a, b])
    nothing = RigidTransform.identity()
    error = {}
    for method in METHODS:
        name = LAYOUT_OF[method]
        plain = matrix(between(*layout(ends, name), 0.5, method).transforms, name)
        error[method] = np.abs(in_space(method, ends, 0.5, nothing, right) - plain).max()
    # The midpoint of a chord compared with the midpoint of its arc.
    assert error["qv_nlerp"] > 0.2
    assert error["qv_slerp"] > 0.2
    assert error["matrix_polar"] > 0.2
    for method in ("dlb", "sclerp", "dib", "matrix_linear"):
        assert error[method] < 1e-14


@given(rigid_motions(), rigid_motions(), st.floats(0.05, 0.95))
def test_sclerp_and_dlb_are_on_one_screw(a, b, t):
    assume((a.inv() * b).rotation.magnitude() < 3.0)
    x, y = layout(a, "dual_quat"), layout(b, "dual_quat")
    whole = sinew.dual_quat.to_screw(sinew.dual_quat.compose(sinew.dual_quat.inverse(x), y))
    assume(whole.angle > 0.1)
    for method in ("dlb", "sclerp"):
        step = sinew.dual_quat.compose(sinew.dual_quat.inverse(x), between(x, y, t, method).transforms)
        part = sinew.dual_quat.to_screw(step)
        close(part.axis, whole.axis, 1e-11)
        if method == "sclerp":
            close(part.moment, whole.moment, 1e-10)
            close([part.angle, part.translation], [t * whole.angle, t * whole.translation], 1e-12)


@given(st.lists(rigid_motions(angle=1.0), min_size=2, max_size=5), st.randoms(use_true_random=False))
def test_signs_and_order_change_no_blend(motions, random):
    weights = np.array([1.0 + i for i in range(len(motions))])
    together = RigidTransform.concatenate(motions)
    order = random.sample(range(len(motions)), len(motions))
    for method in ("qv_nlerp", "qv_slerp", "dlb", "dib"):
        name = LAYOUT_OF[method]
        array = layout(together, name)
        plain = blend(array, weights, method).transforms
        array[:, : 4 if name == "quat_vec" else 8] *= [[random.choice([-1, 1])] for _ in motions]
        other = blend(array[order], weights[order], method).transforms
        close(matrix(other, name), matrix(plain, name), 1e-12)


@given(rigid_motions(), rigid_motions())
def test_nothing_is_ever_nan(a, b):
    for method in METHODS:
        name = LAYOUT_OF[method]
        x, y = layout(a, name, np.float32), layout(b, name, np.float32)
        for t in (-1.0, 0.0, 0.5, 1.0, 2.0):
            assert np.isfinite(between(x, y, t, method).transforms).all()
            weights = np.array([1 - t, t], np.float32)
            assert np.isfinite(blend(np.stack([x, y]), weights, method).transforms).all()


def test_methods_and_layouts_are_those_of_the_table():
    assert set(METHODS) == set(LAYOUT_OF)
    assert set(LAYOUT_OF.values()) == set(LAYOUTS)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_largest_translations_are_finite_and_never_falsely_defined(method, dtype):
    name = LAYOUT_OF[method]
    large = 0.88 * float(np.finfo(dtype).max)  # 3e38 in float32
    a = layout(RigidTransform.identity(), name, dtype)
    b = layout(RigidTransform.from_rotation(Rotation.from_rotvec([0.3, 1.1, -0.4])), name, dtype)
    where = {"affine": (slice(0, 3), 3), "quat_vec": slice(4, 7), "dual_quat": None}[name]
    for end, sign in ((a, 1.0), (b, -1.0)):
        if where is None:
            # real * (0, t) / 2 with t along x, which may be as large as any number.
            w, x, y, z = end[:4]
            end[4:] = sign * (large / 2) * np.array([-x, w, z, -y], dtype)
        else:
            end[where] = [sign * large, sign * large, -sign * large]
    for t in (-1.0, 0.0, 0.3, 0.5, 1.0, 2.0):
        for result in (
            between(a, b, t, method),
            blend(np.stack([a, b, a]), np.array([1 - t, t, 0.1], dtype), method),
        ):
            assert np.isfinite(result.transforms).all(), (method, t)
    spline = sinew.spline.catmull_rom(np.stack([a, b, a]), np.array([0, 1, 2], dtype), 0.5, method)
    assert np.isfinite(spline.transforms).all()
    vector = sinew.spline.catmull_rom_vector(np.stack([a, b, a]), np.array([0, 1, 2], dtype), 0.5)
    assert np.isfinite(vector.transforms).all()
    ends = np.array([-large, large], dtype)
    between_times = sinew.spline.catmull_rom_vector(np.stack([a, b]), ends, 0.0)
    assert np.isfinite(between_times.transforms).all()


SIGNED = ("qv_nlerp", "qv_slerp", "dlb", "dib")


def blends_in_two_orders(method, motions, weights):
    """(blends of [n, 3] motions, whether another order changes the blend)."""
    name = LAYOUT_OF[method]
    size = 4 if name == "quat_vec" else 8
    array = layout(motions, name).reshape(-1, 3, size + (3 if name == "quat_vec" else 0))
    plain = blend(array, weights, method)
    apart = np.zeros(len(array))
    for order in ([1, 2, 0], [2, 0, 1], [0, 2, 1]):
        other = blend(array[:, order], weights[:, order], method)
        distance = sinew.quat_vec.rigid_distance if name == "quat_vec" else sinew.dual_quat.rigid_distance
        apart = np.maximum(apart, distance(plain.transforms, other.transforms).angle)
    return plain, apart > 1e-6


def wide_motions(rng, count):
    """Motions [3 count], up to 143 degrees from the identity."""
    axes = rng.normal(size=(3 * count, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = rng.uniform(0, 2.5, (3 * count, 1))
    rotations = Rotation.from_rotvec(angles * axes)
    return RigidTransform.from_components(rng.uniform(-2, 2, (3 * count, 3)), rotations)


@pytest.mark.parametrize("method", SIGNED)
def test_what_the_order_decides_is_not_defined(method):
    rng = np.random.default_rng(20)
    even = np.ones((2000, 3))
    plain, changes = blends_in_two_orders(method, wide_motions(rng, 2000), even)
    # Never without being reported; and hardly ever reported where nothing changes (two choices of signs can
    # have the same mean).
    assert not (plain.is_defined & changes).any()
    assert 0.1 < changes.mean() < 0.3
    if method in ("qv_nlerp", "dlb"):
        np.testing.assert_array_equal(plain.is_defined, ~changes)
    # With a single heaviest transform, the order does not matter.
    uneven = np.tile([1.0, 1.001, 0.999], (2000, 1))
    plain, changes = blends_in_two_orders(method, wide_motions(rng, 2000), uneven)
    assert not (plain.is_defined & changes).any()
    assert plain.is_defined.mean() > 0.99


def test_turns_by_thirds_are_a_tie():
    turns = sinew.dual_quat.from_axis_angle([0, 0, 1], np.radians([0.0, 120, 240]))
    for method in ("dlb", "dib", "sclerp"):
        assert not blend(turns, np.ones(3), method).is_defined
        assert not blend(turns, np.full(3, np.float32(1 / 3)), method).is_defined
        assert blend(turns, [1.0, 1.1, 1.0], method).is_defined
    assert not blend(sinew.dual_quat.to_quat_vec(turns), np.ones(3), "qv_nlerp").is_defined
    # Near each other, equal weights do not matter.
    near = sinew.dual_quat.from_axis_angle([0, 0, 1], np.radians([0.0, 40, 80]))
    assert blend(near, np.ones(3), "dlb").is_defined


@ALL
def test_what_is_no_rotation_is_not_defined(method):
    name = LAYOUT_OF[method]
    ends = layout(rigid(np.random.default_rng(21), 2), name)
    long = ends.copy()
    if name == "affine":
        long[:, :3, :3] *= 2
    else:
        long[:, : 4 if name == "quat_vec" else 8] *= 2
    # Methods that blend matrices accept a matrix that scales.
    is_any = method in ("matrix_linear", "matrix_polar")
    assert between(*ends, 0.3, method).is_defined
    assert between(*long, 0.3, method).is_defined == is_any
    assert blend(long, [0.3, 0.7], method).is_defined == is_any
    assert np.isfinite(blend(long, [0.3, 0.7], method).transforms).all()


def test_matrix_log_of_shears_and_mirrors_is_not_defined():
    shear = np.eye(4)
    shear[0, 1] = 1
    assert not between(np.eye(4), shear, 0.5, "matrix_log").is_defined
    assert not between(np.eye(4), np.diag([-1.0, 1, 1, 1]), 0.5, "matrix_log").is_defined


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("method", ["qv_slerp", "sclerp", "dib"])
def test_angles_that_are_not_known_are_not_defined(method, dtype):
    ends = layout(rigid(np.random.default_rng(22), 2), LAYOUT_OF[method], dtype)
    for t, is_defined in ((3.0, True), (-100.0, True), (1e30, False)):
        result = between(*ends, dtype(t), method)
        assert result.is_defined == is_defined
        assert np.isfinite(result.transforms).all()
    if dtype == np.float64:
        result = between(*ends, 1e150, method)
        assert not result.is_defined
        assert np.isfinite(result.transforms).all()


def test_signs_by_the_running_sum_are_those_of_skinning():
    rng = np.random.default_rng(23)
    motions = layout(wide_motions(rng, 200), "dual_quat").reshape(200, 3, 8)
    weights = rng.uniform(0.1, 1, (200, 3)).astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    point = np.array([[0.3, -0.2, 0.5]], np.float32)
    differ = 0
    for poses, shares in zip(motions, weights, strict=True):
        offsets, bones = np.array([0, 3], np.int32), np.arange(3, dtype=np.int32)
        matrices = sinew.dual_quat.to_affine(poses).astype(np.float32)
        skinned = sinew.Deformer(point, offsets, bones, shares, "dq").deform(matrices)
        running = blend(poses, shares, "dlb", signs="running_sum")
        close(sinew.dual_quat.transform_point(running.transforms, point), skinned, 2e-4)
        heaviest = blend(poses, shares, "dlb").transforms
        differ += np.abs(sinew.dual_quat.transform_point(heaviest, point) - skinned).max() > 1e-2
    # The rules give different results.
    assert differ > 5


def test_signs_as_given_are_kept_and_others_refused():
    one, half = sinew.dual_quat.from_axis_angle([0, 0, 1], np.radians([20.0, 60]))
    given = blend([one, -half], [0.5, 0.5], "dlb", signs="as_given")
    close(given.transforms, blend([one, sinew.dual_quat.from_axis_angle([0, 0, 1], np.radians(420))],
                                  [0.5, 0.5], "dlb", signs="as_given").transforms)  # fmt: skip
    assert sinew.dual_quat.rigid_distance(given.transforms, one).angle > 2.5
    with pytest.raises(ValueError, match="signs: expected one of heaviest, running_sum, as_given"):
        blend([one, half], [0.5, 0.5], "dlb", signs="shortest")
