# SPDX-License-Identifier: GPL-3.0-or-later
"""Smith 2013, Tables 3.1 and 3.6 to 3.8 and Figures 3.4 and 3.5: what the printed digits are, and why the
columns differ. All numbers are those of `./dev report`.

The axes in the report are rounded and not of unit length (|(0.707, -0.707, 0)| = 0.99985). Its matrix path
normalises the axis (as glm::rotate does), its quaternion path normalises the quaternion (cos, sin axis).
"""

import numpy as np
import pytest
import sinew
from smith_2013 import answers, joints, paths, printed, studies, tables
from smith_2013.tables import AS_REPORT, LAYOUTS, error, moved_combined, moved_one_by_one, pair


def test_table_3_1_memory():
    assert [row.ours for row in tables.memory().rows] == [(12,), (7,), (8,)]
    assert all(row.agrees for row in tables.memory().rows)


def test_table_3_6_translation_of_one_transform():
    # Printed: matrix and pair exact, dual quaternion (1.00000012, -0.00000003, 0.5), which is rounding of
    # float32.
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
    assert [row.agrees for row in tables.translation().rows] == [True] * 3
    assert not tables.translation_errors("affine").any()
    assert not tables.translation_errors("quat_vec").any()
    errors = tables.translation_errors("dual_quat")
    assert 0.05 < (errors > 1e-7).mean() < 0.95
    assert errors.max() < 5e-7


@pytest.mark.parametrize(
    ("name", "wrong"), [("dual_quat", (1.000001, 0, 0.5)), ("affine", (1.00000012, 0, 0.5))]
)
def test_table_3_6_takes_no_error_for_rounding_that_is_none(monkeypatch, name, wrong):
    monkeypatch.setattr(printed, "TRANSLATED", {**printed.TRANSLATED, name: wrong})
    rows = {row.name: row.agrees for row in tables.translation().rows}
    assert rows.pop(printed.NAMES[name]) is False
    assert all(rows.values())


@pytest.mark.parametrize(
    ("name", "tolerance"),
    # Printed digits are those of float32: the pair's are right to a digit or two, the dual quaternion's
    # drift.
    [("affine", 3e-6), ("quat_vec", 2e-6), ("dual_quat", 6e-6)],
)
def test_tables_3_7_and_3_8_are_the_report_s_construction_in_float64(name, tolerance):
    one_by_one = moved_one_by_one(name, np.float64, AS_REPORT[name])
    assert error(one_by_one, printed.ONE_BY_ONE[name]) < tolerance
    combined = moved_combined(name, np.float64, AS_REPORT[name])
    assert error(combined, printed.COMBINED[name]) < 1.2 * tolerance


def test_float64_digits_of_the_pair():
    points = moved_one_by_one("quat_vec", np.float64, "quaternion")
    assert error(points[1], (2.7739085, -0.5862051, 1.0187546)) < 6e-8
    assert error(points[3], (10.8388386, -1.9558195, -4.0957293)) < 6e-8
    assert error(moved_combined("quat_vec", np.float64, "quaternion"), points[3]) < 1e-14


def test_columns_differ_by_the_axes_and_not_by_the_representation():
    # As printed, matrix and pair are 4e-4 apart in Table 3.7; built in the same way, they differ by rounding.
    apart = error(printed.ONE_BY_ONE["affine"], printed.ONE_BY_ONE["quat_vec"])
    assert apart > 4e-4
    mixed = error(
        moved_one_by_one("affine", np.float64, "axis"), moved_one_by_one("quat_vec", np.float64, "quaternion")
    )
    assert mixed == pytest.approx(apart, abs=3e-6)
    for normalise in ("axis", "quaternion"):
        exact = moved_one_by_one("quat_vec", np.float64, normalise)
        for name in LAYOUTS:
            assert error(moved_one_by_one(name, np.float64, normalise), exact) < 5e-14
            assert error(moved_combined(name, np.float64, normalise), exact[-1]) < 5e-14


@pytest.mark.parametrize("normalise", ["axis", "quaternion"])
def test_with_one_construction_float32_agrees_too(normalise):
    # Coordinates reach 10.8, where float32 has steps of 1e-6.
    exact = moved_one_by_one("quat_vec", np.float64, normalise)
    for name in LAYOUTS:
        assert error(moved_one_by_one(name, np.float32, normalise), exact) < 4e-6
        assert error(moved_combined(name, np.float32, normalise), exact[-1]) < 4e-6


@pytest.mark.parametrize("table", [tables.one_by_one(), tables.combined()], ids=["3.7", "3.8"])
def test_rows_show_both_readings(table):
    assert len(table.rows) == (12 if table.number == "3.7" else 3)
    for row in table.rows:
        assert row.agrees
        assert row.more["difference"] == error(row.ours, row.printed) < 6.5e-6
        unit = [float(number) for number in row.more["with unit axes"].split(",")]
        is_matrix = "matri" in row.name
        first = row.name.startswith("A")
        # With unit axes only the matrices are unchanged: theirs have unit length already. A only moves by its
        # translation.
        assert (error(unit, row.printed) < 3e-6) == (is_matrix or first)


def test_a_wrong_digit_is_seen(monkeypatch):
    wrong = {**printed.COMBINED, "quat_vec": (10.8388386, -1.9558198, -4.0957608)}
    monkeypatch.setattr(printed, "COMBINED", wrong)
    assert [row.agrees for row in tables.combined().rows] == [True, False, True]
    assert tables.combined().rows[1].why


def brute_force(method, t, point):
    """Figures 3.4 and 3.5 computed with scipy only."""
    from scipy.spatial.transform import Rotation, Slerp

    (angle_a, axis_a, translation_a), (angle_b, axis_b, translation_b) = printed.ENDS
    rotations = Rotation.from_rotvec(
        [
            np.radians(angle) * np.array(axis) / np.linalg.norm(axis)
            for angle, axis in ((angle_a, axis_a), (angle_b, axis_b))
        ]
    )
    translation = (1 - t) * np.array(translation_a) + t * np.array(translation_b)
    if method == "matrix_linear":
        a, b = rotations.as_matrix()
        return ((1 - t) * a + t * b) @ point + translation
    if method == "qv_slerp":
        return Slerp([0, 1], rotations)(t).apply(point) + translation
    a, b = rotations.as_quat()
    return Rotation.from_quat((1 - t) * a + t * (b if a @ b > 0 else -b)).apply(point) + translation


@pytest.mark.parametrize("method", ["matrix_linear", "qv_nlerp", "qv_slerp"])
@pytest.mark.parametrize("point", [(0, 0, 0), (1, 1, 1)])
def test_paths_of_matrices_and_pairs(method, point):
    path = paths.paths(np.array(point, float), steps=10)[method].moved
    for i, moved in enumerate(path):
        assert error(moved, brute_force(method, i / 10, np.array(point, float))) < 1e-12


def test_all_paths_have_the_same_ends():
    for point in (paths.ORIGIN, paths.CORNER):
        all_paths = paths.paths(point, steps=10)
        assert set(all_paths) == set(sinew.interpolate.METHODS)
        for end in (0, -1):
            expected = brute_force("qv_slerp", -end, point)
            assert all(error(path.moved[end], expected) < 1e-12 for path in all_paths.values())


def test_figures_3_4_and_3_5_show_what_the_report_says():
    for figure in (paths.figure_3_4(), paths.figure_3_5()):
        assert figure.missing is None
        assert len(figure.pictures) == 2
        assert all(fact.agrees for fact in figure.facts)
    shrinking = paths.figure_3_5().facts[0].values
    # Halfway, the mean matrix keeps only the axis of the rotation between the two: by hand, from the sum.
    assert shrinking["matrix_linear"] == pytest.approx(0.1347, abs=1e-4)


def test_figure_3_3_tears_the_elbow_where_bones_are_combined_first():
    figure = joints.figure_3_3()
    assert figure.missing is None
    assert len(figure.pictures) == 2
    assert figure.facts[0].agrees
    gaps = figure.facts[0].values
    # The upper arm's end moves on the circle, the lower arm's head straight: they are apart by its height.
    assert gaps["gap, root, qv_nlerp"] == pytest.approx(1 - np.cos(np.radians(joints.DEGREES / 2)), abs=1e-6)
    # Matrices shrink the upper arm, too: their elbow stays connected, but nothing is rigid.
    assert gaps["gap, root, matrix_linear"] < 1e-12
    assert gaps["gap, root, dlb"] > 0.05
    assert max(gap for name, gap in gaps.items() if name.startswith("gap, parent")) < 1e-12


def test_plots_name_every_method():
    for picture in (*paths.figure_3_4().pictures, *paths.figure_3_5().pictures):
        for method in sinew.interpolate.METHODS:
            if "rotated" in picture.caption and method == "matrix_linear":
                continue
            assert f">{method}<" in picture.content, (picture.caption, method)


def test_dlb_and_sclerp_differ_by_as_much_as_the_report_says():
    fact = answers.dlb_bound()
    assert fact.agrees
    assert fact.values["degrees"] == pytest.approx(8.15, abs=0.05)
    assert fact.values["share of translation"] == pytest.approx(0.15, abs=0.005)


def test_a_joint_drifts_at_most_as_far_as_nlerp_from_slerp():
    times, half = np.array(studies.TIMES), np.pi / 4
    nlerp = np.arctan2(times * np.sin(half), 1 - times + times * np.cos(half))
    # For a chain of two links only the first joint moves the tip; two keys are at most 90 degrees apart.
    at_most = np.sin(np.abs(nlerp - times * half).max())
    assert 0.1 * at_most < studies.drift(2).high < at_most


def test_what_a_study_gives_is_of_many_chains():
    short, long = studies.drift(4, chains=200), studies.drift(64, chains=200)
    assert short.low < short.rms < short.high
    assert long.rms > 1.5 * short.rms
    # By hand: chains of links of length 1, in float64 and in float32, as products of 3x3 matrices.
    for name, spread in studies.accuracy(16, chains=200).items():
        assert 1e-8 < spread.low < spread.rms < 1e-6, name


def test_the_end_of_a_chain_is_that_of_its_matrices():
    random = np.random.default_rng(1)
    angles = random.uniform(-3, 3, (5, 4))
    links = studies._links(studies._random_axes(random, (5, 4)), angles)
    matrices = sinew.quat_vec.to_affine(links)
    for each, end in zip(matrices, studies._end(sinew.quat_vec, links), strict=True):
        assert error(np.linalg.multi_dot(each)[:3, 3], end) < 1e-14


def test_tables_3_7_and_3_8_have_float32_beside_float64():
    for table in (tables.one_by_one(), tables.combined()):
        for row in table.rows:
            single = [float(number) for number in row.more["in float32"].split(", ")]
            assert error(single, row.ours) < 5e-6
            assert row.more["float32, difference"] == pytest.approx(error(single, row.printed), abs=1e-7)


def test_what_is_said_of_the_chain_is_held_to_ours():
    (apart,) = tables.one_by_one().facts
    # With the same axis for all, only rounding remains: not 1e-5, and it does not grow with each link.
    assert max(apart.values.values()) < 2e-6
    assert not apart.agrees
    (combined,) = tables.combined().facts
    assert combined.values == {
        name: error(
            moved_combined(name, np.float32, AS_REPORT[name]),
            moved_one_by_one(name, np.float32, AS_REPORT[name])[-1],
        )
        for name in LAYOUTS
    }
