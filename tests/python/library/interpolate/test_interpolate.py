# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects sinew.interpolate where results broadcast, are not defined, depend on the order or are huge.
exact_interpolation.py has the oracles."""

import numpy as np
import pytest
import sinew
from motions import LAYOUT_OF, close, layout, matrix, rigid
from scipy.spatial.transform import RigidTransform, Rotation
from sinew.interpolate import METHODS, between, blend

ALL = pytest.mark.parametrize("method", METHODS)


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


@ALL
def test_repeated_transforms_count_with_all_their_weights(method):
    name, order = LAYOUT_OF[method], np.array([0, 1, 2, 1, 0, 2, 2, 0])
    rng = np.random.default_rng(4)
    twists = np.column_stack([rng.uniform(-0.5, 0.5, (3, 3)), rng.uniform(-2, 2, (3, 3))])
    three = layout(rigid(rng) * RigidTransform.from_exp_coords(twists), name)
    weights = rng.uniform(0.05, 1.0, len(order))
    many = blend(three[order], weights, method).transforms
    once = blend(three, np.bincount(order, weights), method).transforms
    close(matrix(many, name), matrix(once, name), 1e-12)


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
    # Weights without a sum give the heaviest.
    for weights, heaviest in (((0, 0, 0), 0), ((-1, 1, 0), 1), ((-2, -1, -3), 1)):
        nothing = blend(array, np.array(weights, dtype), method)
        np.testing.assert_array_equal(nothing.transforms, array[heaviest])
        assert not nothing.is_defined
    # Rotations by 180 degrees about three axes and none: their matrices have the sum 0.
    turns = Rotation.from_rotvec(np.pi * np.eye(4, 3, -1))
    cancelling = blend(layout(RigidTransform.from_rotation(turns), name, dtype), np.ones(4, dtype), method)
    assert np.isfinite(cancelling.transforms).all()
    assert cancelling.is_defined == defined


@ALL
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_weights_of_any_size_are_shares(method, dtype):
    """Their sum overflows, or 1 over it does."""
    name = LAYOUT_OF[method]
    array = layout(rigid(np.random.default_rng(6), 2), name, dtype)[[0, 1, 0]]
    want = blend(array, np.array([1, 0.5, 1], dtype), method)
    for size in (np.finfo(dtype).max, 16 * np.finfo(dtype).smallest_subnormal):
        got = blend(array, size * np.array([1, 0.5, 1], dtype), method)
        assert got.is_defined == want.is_defined
        close(got.transforms, want.transforms, 4096 * np.finfo(dtype).eps)


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
    for t in (-1.0, 0.0, 0.3, 0.5, 1.0, 2.0, -1e30, 3e38):
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


def test_matrix_polar_is_the_nearest_rotation_even_to_a_mirror():
    """The mean of rotations by 180 degrees about three axes is -1/3: all rotations are equally near."""
    turns = layout(RigidTransform.from_rotation(Rotation.from_rotvec(np.pi * np.eye(3))), "affine")
    tie = blend(turns, np.ones(3), "matrix_polar")
    assert not tie.is_defined
    close(tie.transforms[:3, :3] @ tie.transforms[:3, :3].T, np.eye(3))
    # A slightly larger weight breaks the tie.
    uneven = blend(turns, [1, 1, 1.5], "matrix_polar")
    assert uneven.is_defined
    close(uneven.transforms, turns[2], 1e-12)


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
def test_blends_that_depend_on_the_order_are_not_defined(method):
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


def test_three_rotations_by_120_degrees_are_a_tie():
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
def test_transforms_that_are_not_rigid_are_not_defined(method):
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
