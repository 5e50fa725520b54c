# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects splines at their ends and cuts, skeletons' keyframes, and what these refuse.
exact_interpolation.py has the oracles."""

import numpy as np
import pytest
import sinew
from motions import LAYOUT_OF, layout, matrix, rigid
from scipy.spatial.transform import RigidTransform, Rotation
from sinew.interpolate import METHODS, between, blend
from sinew.spline import catmull_rom, catmull_rom_vector

TIMES = np.array([0.0, 1.0, 1.5, 4.0, 5.0])
AT = np.linspace(-0.5, 5.5, 61)
ALL = pytest.mark.parametrize("method", METHODS)


def close(got, wanted, tolerance=1e-13):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


@ALL
def test_passes_through_keys_and_holds_at_the_ends(method):
    name = LAYOUT_OF[method]
    motions = rigid(np.random.default_rng(2), 5)
    for form in (catmull_rom, catmull_rom_vector):
        more = (method,) if form is catmull_rom else ()
        result = form(layout(motions, name), TIMES, np.array([*TIMES, -1.0, 9.0]), *more)
        close(matrix(result.transforms, name), motions[[0, 1, 2, 3, 4, 0, 4]].as_matrix(), 1e-12)


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
    at_once = catmull_rom(keys[:3], np.ones(3), np.array([0.5, 1.0]), method).transforms
    close(matrix(at_once, name), matrix(keys[[0, 2]], name), 1e-13)
    close(whole[2], catmull_rom(keys[2:], times[2:], 1.5, method).transforms, 1e-14)


PARENTS = np.int32([-1, 0, 1, 1])


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
