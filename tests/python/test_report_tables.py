# SPDX-License-Identifier: GPL-3.0-or-later
"""Smith 2013, Tables 3.6 to 3.8: what the printed digits are, and why the columns differ.

The axes in the report are rounded and not of unit length (|(0.707, -0.707, 0)| = 0.99985). Its matrix path
normalises the axis (as glm::rotate does), its quaternion path the quaternion (cos, sin axis).
"""

import numpy as np
import pytest
import sinew

# Table 3.7: angle in degrees, axis and translation of transforms A to D; applied in this order.
CHAIN = [
    (70, (-0.089, 0.445, -0.89), (2, 2, 2)),
    (70, (-0.667, -0.333, -0.667), (0, -2, -0.5)),
    (170, (0.707, -0.707, 0), (10, -1, -4)),
    (10, (0.707, 0, 0.707), (0, 0, 1)),
]
TABLE_3_7 = {
    "affine": [
        (2.0, 2.0, 2.0),
        (2.7737715, -0.5859429, 1.0187607),
        (10.4774714, -3.8822441, -4.7346449),
        (10.8386106, -1.9554013, -4.0957837),
    ],
    "quat_vec": [
        (2.0, 2.0, 2.0),
        (2.7739086, -0.5862051, 1.0187545),
        (10.4777184, -3.8823950, -4.7346096),
        (10.8388376, -1.9558195, -4.0957294),
    ],
    "dual_quat": [
        (2.0000005, 2.0000007, 2.0000002),
        (2.7739096, -0.5862050, 1.0187547),
        (10.4777203, -3.8823957, -4.7346106),
        (10.8388424, -1.9558202, -4.0957308),
    ],
}
TABLE_3_8 = {
    "affine": (10.8386087, -1.9554017, -4.0957837),
    "quat_vec": (10.8388386, -1.9558198, -4.0957308),
    "dual_quat": (10.8388443, -1.9558202, -4.0957317),
}
LAYOUTS = {"affine": sinew.affine, "quat_vec": sinew.quat_vec, "dual_quat": sinew.dual_quat}


def pair(angle, axis, translation, dtype, normalise):
    """A quaternion-vector pair built by normalising the `normalise`: "axis" or "quaternion"."""
    half, axis = np.radians(angle) / 2, np.array(axis, np.float64)
    if normalise == "axis":
        axis /= np.linalg.norm(axis)
    quaternion = np.array([np.cos(half), *(np.sin(half) * axis)])
    quaternion /= np.linalg.norm(quaternion)
    return np.array([*quaternion, *translation], dtype)


def chain(name, dtype, normalise):
    pairs = np.array([pair(*row, dtype, normalise) for row in CHAIN])
    return pairs if name == "quat_vec" else getattr(sinew.quat_vec, f"to_{name}")(pairs)


def one_by_one(name, dtype, normalise):
    """Table 3.7: the point (0, 0, 0) after each transform in turn, [4, 3]."""
    point, points = np.zeros(3, dtype), []
    for transform in chain(name, dtype, normalise):
        point = LAYOUTS[name].transform_point(transform, point)
        points.append(point)
    return np.array(points)


def combined(name, dtype, normalise):
    """Table 3.8: the same by one transform, D C B A, [3]."""
    module = LAYOUTS[name]
    a, b, c, d = chain(name, dtype, normalise)
    product = module.compose(d, module.compose(c, module.compose(b, a)))
    return module.transform_point(product, np.zeros(3, dtype))


def error(got, printed):
    return np.abs(np.asarray(got, np.float64) - np.array(printed)).max()


AS_REPORT = {"affine": "axis", "quat_vec": "quaternion", "dual_quat": "quaternion"}


def test_table_3_6_translation_of_one_transform():
    # Printed: matrix and pair exact, dual quaternion (1.00000012, -0.00000003, 0.5): rounding of float32.
    for normalise in ("axis", "quaternion"):
        for dtype in (np.float32, np.float64):
            motion = pair(80, (0, 1, 1), (1, 0, 0.5), dtype, normalise)
            zero = np.zeros(3, dtype)
            for name in ("affine", "quat_vec"):
                array = motion if name == "quat_vec" else sinew.quat_vec.to_affine(motion)
                moved = LAYOUTS[name].transform_point(array, zero)
                np.testing.assert_array_equal(moved, [1, 0, 0.5])
            moved = sinew.dual_quat.transform_point(sinew.quat_vec.to_dual_quat(motion), zero)
            assert error(moved, (1, 0, 0.5)) <= 2 * np.finfo(dtype).eps


@pytest.mark.parametrize(
    ("name", "tolerance"),
    # Printed digits are float32's: the pair's are good to a digit or two, the dual quaternion's drift.
    [("affine", 3e-6), ("quat_vec", 2e-6), ("dual_quat", 6e-6)],
)
def test_tables_3_7_and_3_8_are_the_report_s_construction_in_float64(name, tolerance):
    assert error(one_by_one(name, np.float64, AS_REPORT[name]), TABLE_3_7[name]) < tolerance
    assert error(combined(name, np.float64, AS_REPORT[name]), TABLE_3_8[name]) < 1.2 * tolerance


def test_float64_digits_of_the_pair():
    points = one_by_one("quat_vec", np.float64, "quaternion")
    assert error(points[1], (2.7739085, -0.5862051, 1.0187546)) < 6e-8
    assert error(points[3], (10.8388386, -1.9558195, -4.0957293)) < 6e-8
    assert error(combined("quat_vec", np.float64, "quaternion"), points[3]) < 1e-14


def test_columns_differ_by_the_axes_and_not_by_the_representation():
    # As printed, matrix and pair are 4e-4 apart in Table 3.7; by one construction, rounding.
    assert error(TABLE_3_7["affine"], TABLE_3_7["quat_vec"]) > 4e-4
    mixed = error(one_by_one("affine", np.float64, "axis"), one_by_one("quat_vec", np.float64, "quaternion"))
    assert mixed == pytest.approx(error(TABLE_3_7["affine"], TABLE_3_7["quat_vec"]), abs=3e-6)
    for normalise in ("axis", "quaternion"):
        exact = one_by_one("quat_vec", np.float64, normalise)
        for name in LAYOUTS:
            assert error(one_by_one(name, np.float64, normalise), exact) < 5e-14
            assert error(combined(name, np.float64, normalise), exact[-1]) < 5e-14


@pytest.mark.parametrize("normalise", ["axis", "quaternion"])
def test_with_one_construction_float32_agrees_too(normalise):
    # Coordinates reach 10.8, where float32 has steps of 1e-6.
    exact = one_by_one("quat_vec", np.float64, normalise)
    for name in LAYOUTS:
        assert error(one_by_one(name, np.float32, normalise), exact) < 4e-6
        assert error(combined(name, np.float32, normalise), exact[-1]) < 4e-6
