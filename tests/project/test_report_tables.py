# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what is computed for Smith 2013, Tables 3.1 and 3.6 to 3.8 and Figures 3.4 and 3.5: what the
printed digits are, and why the columns differ. All numbers are those of `./dev report`.

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


def test_dlb_and_sclerp_differ_by_as_much_as_the_report_says():
    fact = answers.dlb_bound()
    assert fact.agrees
    assert fact.values["degrees"] == pytest.approx(8.15, abs=0.05)
    assert fact.values["share of translation"] == pytest.approx(0.15, abs=0.005)


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
