# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects mended weights: compared with plain matrices in float64."""

from __future__ import annotations

import numpy as np
import pytest
from sinew_addon.features.diagnose.mend import SMOOTH_FACTOR, SMOOTH_STEPS, WeightMender
from sinew_addon.skinning.influences import GroupWeights

GROUPS, VERTICES = 5, 12
# A ring.
EDGES = np.array([(v, (v + 1) % VERTICES) for v in range(VERTICES)], dtype=np.int32)


def weights_of(dense: np.ndarray) -> GroupWeights:
    """dense  [vertices, groups]"""
    vertices, groups = np.nonzero(dense)
    counts = np.bincount(vertices, minlength=len(dense)).astype(np.int32)
    return GroupWeights(counts, groups.astype(np.int32), dense[vertices, groups].astype(np.float32))


def random_dense(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.05, 1.0, (VERTICES, GROUPS)).astype(np.float32)


def mender(dense: np.ndarray, masks: tuple[int, ...] = (), locked: tuple[int, ...] = ()) -> WeightMender:
    is_bone, is_locked = np.ones(GROUPS, dtype=bool), np.zeros(GROUPS, dtype=bool)
    is_bone[list(masks)], is_locked[list(locked)] = False, True
    return WeightMender(weights_of(dense), is_bone, is_locked)


def as_dense(rows: dict[int, dict[int, float]], dense: np.ndarray) -> np.ndarray:
    result = dense.astype(np.float64)
    for vertex, row in rows.items():
        result[vertex] = 0.0
        for group, weight in row.items():
            result[vertex, group] = weight
    return result


@pytest.mark.parametrize("limit", [1, 2, 4, 9])
def test_limit_keeps_the_largest_and_sums_to_one(limit):
    dense = random_dense(1)
    got = as_dense(mender(dense).limited([2, 3, 7], limit), dense)
    expected = dense.astype(np.float64)
    for vertex in (2, 3, 7):
        smallest = np.argsort(expected[vertex])[: max(GROUPS - limit, 0)]
        expected[vertex, smallest] = 0.0
        expected[vertex] /= expected[vertex].sum()
    np.testing.assert_allclose(got, expected, atol=1e-7)


def test_masks_stay_and_locked_groups_take_their_share_first():
    dense = random_dense(2)
    dense[4] = (0.25, 0.5, 0.1, 0.8, 0.2)
    rows = mender(dense, masks=(3,), locked=(0,)).limited([4], 2)
    assert rows[4].keys() == {0, 1, 3}
    assert rows[4][0] == pytest.approx(0.25)
    assert rows[4][1] == pytest.approx(0.75)
    assert rows[4][3] == pytest.approx(0.8)
    rows = mender(dense, masks=(3,), locked=(0,)).normalized([4])
    assert rows[4][3] == pytest.approx(0.8)
    assert sum(rows[4][group] for group in (0, 1, 2, 4)) == pytest.approx(1.0)


def test_smoothing_is_repeated_averaging_with_the_neighbours():
    dense = random_dense(3)
    dense /= dense.sum(axis=1, keepdims=True)
    chosen = [0, 1, 2, 6]
    averages = np.eye(VERTICES)
    for vertex in chosen:
        averages[vertex] = 0.0
        averages[vertex, vertex] = 1.0 - SMOOTH_FACTOR
        averages[vertex, [(vertex - 1) % VERTICES, (vertex + 1) % VERTICES]] += 0.5 * SMOOTH_FACTOR
    expected = np.linalg.matrix_power(averages, SMOOTH_STEPS) @ dense.astype(np.float64)
    got = as_dense(mender(dense).smoothed(chosen, EDGES, GROUPS), dense)
    np.testing.assert_allclose(got, expected, atol=1e-6)
    assert np.abs(expected - dense).max() > 0.01
    limited = mender(dense).smoothed(chosen, EDGES, 2)
    assert {len(row) for row in limited.values()} == {2}


def test_what_has_no_weights_is_filled_from_the_border_inwards():
    dense = np.zeros((VERTICES, GROUPS), dtype=np.float32)
    dense[0, 0] = dense[4, 1] = 1.0
    rows = mender(dense).filled([1, 2, 3], EDGES, 4)
    assert rows[1] == {0: 1.0}
    assert rows[3] == {1: 1.0}
    assert rows[2] == pytest.approx({0: 0.5, 1: 0.5})
    lonely = np.array([(8, 9)], dtype=np.int32)
    assert mender(dense).filled([8, 9], lonely, 4) == {}
