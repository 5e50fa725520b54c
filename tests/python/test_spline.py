# SPDX-License-Identifier: GPL-3.0-or-later
"""sinew.spline and Skeleton's keyframes compared with float64 code written from the report."""

import numpy as np
import pytest
import sinew
from hypothesis import given
from hypothesis import strategies as st
from motions import LAYOUT_OF, LAYOUTS, layout, matrix, rigid
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import RigidTransform, Rotation
from sinew.interpolate import METHODS, between, blend
from sinew.spline import catmull_rom, catmull_rom_vector

TIMES = np.array([0.0, 1.0, 1.5, 4.0, 5.0])
AT = np.linspace(-0.5, 5.5, 61)
ALL = pytest.mark.parametrize("method", METHODS)


def close(got, wanted, tolerance=1e-13):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


def reference(keys, times, at):
    """Smith 2013, section 2.3.2, with scipy's Hermite spline; one-sided tangents at the ends, constant
    outside."""
    flat = keys.reshape(len(keys), -1)
    after = np.minimum(np.arange(len(keys)) + 1, len(keys) - 1)
    before = np.maximum(np.arange(len(keys)) - 1, 0)
    tangents = (flat[after] - flat[before]) / (times[after] - times[before])[:, None]
    spline = CubicHermiteSpline(times, flat, tangents)
    return spline(np.clip(at, times[0], times[-1])).reshape(len(at), *keys.shape[1:])


def on_one_side(keys, size):
    """Signs that put each quaternion into the hemisphere of the one before."""
    keys = keys.copy()
    for i in range(1, len(keys)):
        if keys[i, :4] @ keys[i - 1, :4] < 0:
            keys[i, :size] *= -1
    return keys


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_vector_form_is_the_hermite_spline_of_the_components(name, dtype):
    for seed in range(5):
        keys = layout(rigid(np.random.default_rng(seed), 5), name, dtype)
        result = catmull_rom_vector(keys, TIMES.astype(dtype), AT.astype(dtype))
        assert result.transforms.dtype == dtype
        assert result.is_defined.all()
        if name == "affine":
            wanted, got = reference(keys, TIMES, AT), result.transforms
        else:
            size = 4 if name == "quat_vec" else 8
            wanted = reference(on_one_side(keys.astype(np.float64), size), TIMES, AT)
            # The sign is that of the given key before.
            flip = np.where((result.transforms[:, :4] * wanted[:, :4]).sum(axis=1) < 0, -1.0, 1.0)[:, None]
            got = result.transforms * np.where(np.arange(keys.shape[1]) < size, flip, 1.0)
        close(got, wanted, 64 * np.finfo(dtype).eps)


@ALL
def test_blend_form_is_the_blend_with_the_weights_of_the_spline(method):
    # Within 57 degrees of each other, all are in one hemisphere, whichever key is the heaviest.
    name, rng = LAYOUT_OF[method], np.random.default_rng(1)
    twists = np.column_stack([rng.uniform(-0.29, 0.29, (5, 3)), rng.uniform(-2, 2, (5, 3))])
    keys = layout(rigid(rng) * RigidTransform.from_exp_coords(twists), name)
    weights = reference(np.eye(5), TIMES, AT)
    result = catmull_rom(keys, TIMES, AT, method)
    assert result.is_defined.all()
    wanted = blend(keys, weights, method).transforms
    close(matrix(result.transforms, name), matrix(wanted, name), 1e-12)


@ALL
def test_passes_through_keys_and_holds_at_the_ends(method):
    name = LAYOUT_OF[method]
    motions = rigid(np.random.default_rng(2), 5)
    for form in (catmull_rom, catmull_rom_vector):
        more = (method,) if form is catmull_rom else ()
        result = form(layout(motions, name), TIMES, np.array([*TIMES, -1.0, 9.0]), *more)
        close(matrix(result.transforms, name), motions[[0, 1, 2, 3, 4, 0, 4]].as_matrix(), 1e-12)


@ALL
def test_blend_form_is_rigid_and_vector_form_is_not(method):
    name = LAYOUT_OF[method]
    keys = layout(rigid(np.random.default_rng(3), 5), name)

    def error(array):
        if name == "affine":
            linear = array[:, :3, :3]
            return np.abs(np.swapaxes(linear, 1, 2) @ linear - np.eye(3)).max()
        return np.abs((array[:, :4] ** 2).sum(axis=1) - 1).max()

    assert error(catmull_rom_vector(keys, TIMES, AT).transforms) > 0.1
    rigid_error = error(catmull_rom(keys, TIMES, AT, method).transforms)
    assert rigid_error > 0.1 if method == "matrix_linear" else rigid_error < 1e-13


@ALL
def test_one_key_and_two(method):
    name = LAYOUT_OF[method]
    keys = layout(rigid(np.random.default_rng(4), 2), name)
    single = catmull_rom(keys[:1], TIMES[:1], AT, method)
    close(matrix(single.transforms, name), np.tile(matrix(keys[0], name), (len(AT), 1, 1)))
    # Between two keys the tangents have the direction of the straight line.
    t = np.array([0.25, 0.5, 0.75])
    double = catmull_rom(keys, TIMES[:2], t, method)
    straight = between(keys[0], keys[1], t, method)
    close(matrix(double.transforms, name), matrix(straight.transforms, name), 1e-12)


@ALL
def test_keys_of_equal_time_are_a_cut(method):
    name = LAYOUT_OF[method]
    keys = layout(rigid(np.random.default_rng(5), 4), name)
    times = np.array([0.0, 1.0, 1.0, 2.0])
    whole = catmull_rom(keys, times, np.array([0.5, 1.0, 1.5]), method).transforms
    close(whole[0], catmull_rom(keys[:2], times[:2], 0.5, method).transforms, 1e-14)
    close(matrix(whole[1], name), matrix(keys[2], name), 1e-13)
    close(whole[2], catmull_rom(keys[2:], times[2:], 1.5, method).transforms, 1e-14)


@given(st.lists(st.floats(0.01, 3.0), min_size=1, max_size=6), st.floats(0.0, 1.0), st.floats(0.1, 10.0))
def test_only_relations_of_times_matter(steps, part, scale):
    times = np.concatenate([[0.0], np.cumsum(steps)])
    keys = layout(rigid(np.random.default_rng(6), len(times)), "dual_quat")
    plain = catmull_rom(keys, times, part * times[-1]).transforms
    scaled = catmull_rom(keys, scale * times, part * (scale * times[-1])).transforms
    if not np.isclose(times, part * times[-1], atol=1e-9).any():
        close(matrix(scaled, "dual_quat"), matrix(plain, "dual_quat"), 1e-9)


PARENTS = np.int32([-1, 0, 1, 1])


@ALL
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_skeleton_interpolates_each_bone(method, dtype):
    name = LAYOUT_OF[method]
    motions = rigid(np.random.default_rng(9), 4)
    step = RigidTransform.from_exp_coords([0.3, -0.4, 0.8, 1.0, 2.0, 3.0])
    keys = np.stack([layout(motions * step**i, name, dtype) for i in range(5)])
    skeleton = sinew.Skeleton(PARENTS)
    bones, defined = skeleton.interpolate(keys[0], keys[1], 0.3, method)
    assert bones.dtype == dtype
    assert defined is True
    np.testing.assert_array_equal(bones, between(keys[0], keys[1], 0.3, method).transforms)
    bones, defined = skeleton.spline(keys, TIMES.astype(dtype), 2.5, method)
    assert defined is True
    vectors, _ = skeleton.spline_vector(keys, TIMES.astype(dtype), 2.5)
    for bone in range(4):
        one = catmull_rom(keys[:, bone], TIMES.astype(dtype), 2.5, method).transforms
        np.testing.assert_array_equal(bones[bone], one)
        one = catmull_rom_vector(keys[:, bone], TIMES.astype(dtype), 2.5).transforms
        np.testing.assert_array_equal(vectors[bone], one)


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_root_relative_in_every_representation(name, dtype):
    m = rigid(np.random.default_rng(7), 4)
    wanted = np.array([x.as_matrix() for x in (m[0], m[0] * m[1], m[0] * m[1] * m[2], m[0] * m[1] * m[3])])
    result = sinew.Skeleton(PARENTS).root_relative(layout(m, name, dtype))
    assert result.dtype == dtype
    close(matrix(result, name), wanted, 64 * np.finfo(dtype).eps)


# Smith 2013, Figure 3.3: an arm of two bones of length 1, both rotated by 90 degrees between the keyframes.
@pytest.mark.parametrize("method", ["matrix_polar", "qv_nlerp", "qv_slerp", "dlb", "sclerp"])
def test_interpolating_after_combining_tears_the_elbow(method):
    name, arm = LAYOUT_OF[method], sinew.Skeleton(np.int32([-1, 0]))

    def pose(degrees):
        rotation = Rotation.from_rotvec([[0, 0, degrees], [0, 0, degrees]], degrees=True)
        return layout(RigidTransform.from_components([[0, 0, 0], [1, 0, 0]], rotation), name)

    def gap(bones):
        upper, lower = matrix(bones, name)
        return np.linalg.norm((upper @ [1, 0, 0, 1] - lower @ [0, 0, 0, 1])[:3])

    relative, _ = arm.interpolate(pose(0), pose(90), 0.5, method)
    assert gap(arm.root_relative(relative)) < 1e-14
    after, _ = arm.interpolate(arm.root_relative(pose(0)), arm.root_relative(pose(90)), 0.5, method)
    assert gap(after) > 0.1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda k: catmull_rom(k[:0], TIMES[:0], 0.5), "keys: expected one axis of keys, at least one"),
        (
            lambda k: catmull_rom(k, TIMES[:3], 0.5),
            "times: expected float64 [5], one for each key, got float64 [3]",
        ),
        (
            lambda k: catmull_rom(k, TIMES[::-1].copy(), 0.5),
            "times: expected times that do not decrease, got a smaller one at index 1",
        ),
        (
            lambda k: catmull_rom(k, TIMES, np.nan),
            "at: expected finite values, got NaN or infinity at index 0",
        ),
        (lambda k: catmull_rom(k, TIMES, 0.5, "cubic"), "method: expected one of matrix_linear, "),
        (
            lambda k: catmull_rom(k, TIMES, 0.5, "qv_nlerp"),
            "keys: expected float64 [.., 7], got float64 [5, 8]",
        ),
        (
            lambda k: catmull_rom_vector(k[:, :5], TIMES, 0.5),
            "keys: expected float32 or float64 [keys, 4, 4], ",
        ),
        (
            lambda k: sinew.Skeleton(PARENTS).interpolate(k, k, 0.5),
            "a: expected 4 bones, got 5",
        ),
        (
            lambda k: sinew.Skeleton(PARENTS).spline(k[None], TIMES[:1], 0.5),
            "keyframes: expected one key or more of 4 bones, got float64 [1, 5, 8]",
        ),
        (lambda k: blend(k, TIMES[:3]), "weights: expected float64 [.., 5], one for each transform, got"),
        (lambda k: blend(k[:0], TIMES[:0]), "transforms: expected at least one transform, got none"),
        (lambda k: between(k, k[:3], 0.5), "b: expected leading axes that broadcast with [5], got [3]"),
        (lambda k: between(k, 1j * k, 0.5), "b: expected float32 or float64 [.., 8], got complex128"),
        (lambda k: between(k, k, "x"), "t: expected a number or float64 [..], got str"),
        (lambda k: between(k, k, 1j), "t: expected a number or float64 [..], got complex"),
        (lambda k: between(k, k, np.complex64(1j)), "t: expected a number or float64 [..], got complex64"),
        (lambda k: sinew.dual_quat.inverse([*k, [1]]), "a: expected float32 or float64 [.., 8], got list"),
        (
            lambda k: sinew.dual_quat.inverse(k.astype("M8[s]")),
            "a: expected float32 or float64 [.., 8], got datetime64[s] [5, 8]",
        ),
        (
            lambda k: sinew.affine.inverse(np.zeros((4, 4))),
            "a: expected an invertible transform, got one of determinant 0",
        ),
    ],
)
def test_refusals_name_argument_wanted_and_got(call, message):
    keys = layout(rigid(np.random.default_rng(8), 5), "dual_quat")
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        call(keys)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_hermite_of_points_is_scipys(dtype):
    rng = np.random.default_rng(30)
    points, tangents = rng.normal(size=(2, 5, 3)).astype(dtype)
    result = sinew.spline.hermite(points, tangents, TIMES.astype(dtype), AT.astype(dtype))
    wanted = CubicHermiteSpline(TIMES, points, tangents)(np.clip(AT, TIMES[0], TIMES[-1]))
    close(result.transforms, wanted, 64 * np.finfo(dtype).eps)
    assert result.is_defined.all()
    # With Catmull-Rom's tangents it equals that spline, for points, too.
    plain = catmull_rom_vector(points.astype(float), TIMES, AT).transforms
    close(plain, reference(points.astype(float), TIMES, AT), 1e-13)


def test_hermite_of_transforms_passes_with_the_velocities_given_and_is_rigid():
    rng = np.random.default_rng(31)
    for _ in range(20):
        keys = layout(rigid(rng, 4), "dual_quat")
        twists = rng.normal(size=(4, 6))
        times = np.array([0.0, 1, 1.5, 4])
        at = sinew.spline.hermite(keys, twists, times, times)
        assert sinew.dual_quat.rigid_distance(at.transforms, keys).translation.max() < 1e-13
        for side in (1e-6, -1e-6):
            near = sinew.spline.hermite(keys, twists, times, times[1:3] + side).transforms
            step = sinew.dual_quat.compose(sinew.dual_quat.inverse(keys[1:3]), near)
            close(sinew.dual_quat.to_twist(step) / side, twists[1:3], 3e-4)
        whole = sinew.spline.hermite(keys, twists, times, np.linspace(0, 4, 50)).transforms
        close(sinew.dual_quat.norm(whole), np.tile([1, 0], (50, 1)), 1e-13)


def test_hermite_at_a_constant_velocity_is_the_screw():
    screw = np.array([0.3, -0.2, 0.4, 1, 2, 3.0])
    times = np.array([0.0, 2, 3])
    keys = sinew.dual_quat.from_twist(times[:, None] * screw)
    at = np.linspace(0, 3, 31)
    result = sinew.spline.hermite(keys, np.tile(screw, (3, 1)), times, at).transforms
    close(
        matrix(result, "dual_quat"),
        matrix(sinew.dual_quat.from_twist(at[:, None] * screw), "dual_quat"),
        1e-12,
    )


def test_hermite_names_its_arguments():
    keys = np.zeros((3, 3))
    for call, argument in (
        (lambda: sinew.spline.hermite(keys, keys[:2], [0, 1, 2], 0.5), "tangents"),
        (lambda: sinew.spline.hermite(keys[:0], keys[:0], [], 0.5), "keys"),
        (lambda: sinew.spline.hermite(keys, keys, [0, 1], 0.5), "times"),
        (lambda: sinew.spline.hermite(np.zeros((3, 7)), keys, [0, 1, 2], 0.5), "keys"),
    ):
        with pytest.raises(ValueError, match=f"^{argument}: expected"):
            call()


@ALL
def test_skeletons_take_many_times_in_one_call(method):
    rng = np.random.default_rng(32)
    skeleton = sinew.Skeleton([-1, 0, 1])
    keys = np.stack([layout(rigid(rng, 3), LAYOUT_OF[method]) for _ in range(3)])
    t = np.array([[0.0, 0.3], [0.7, 1.0]])
    transforms, is_defined = skeleton.interpolate(keys[0], keys[1], t, method)
    assert transforms.shape == (2, 2, *keys[0].shape)
    assert is_defined.shape == (2, 2)
    one, defined = skeleton.interpolate(keys[0], keys[1], 0.3, method)
    assert isinstance(defined, bool)
    np.testing.assert_array_equal(transforms[0, 1], one)
    several, are_defined = skeleton.spline(keys, [0, 1, 2], [0.5, 1.5], method)
    np.testing.assert_array_equal(several[1], skeleton.spline(keys, [0, 1, 2], 1.5, method)[0])
    assert are_defined.shape == (2,)
