# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects influences from vertex groups."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from sinew_addon.skinning.influences import GroupWeights, Influences, entries_of_bones


def random_groups(seed: int, zeros: bool, vertices: int = 200) -> GroupWeights:
    """Groups 0 to 4, with none to four entries for each vertex."""
    random = np.random.default_rng(seed)
    counts = random.integers(0, 5, vertices, dtype=np.int32)
    weights = random.uniform(0.1, 1.0, counts.sum()).astype(np.float32)
    if zeros:
        weights[random.random(len(weights)) < 0.3] = 0.0
    return GroupWeights(counts, random.integers(0, 5, counts.sum(), dtype=np.int32), weights)


def in_a_loop(groups: GroupWeights, bone_of_group: np.ndarray) -> list[list[tuple[int, np.float32]]]:
    ends = np.cumsum(groups.counts)
    found = []
    for begin, end in zip(ends - groups.counts, ends, strict=True):
        entries = [
            (int(bone_of_group[group]), weight)
            for group, weight in zip(groups.groups[begin:end], groups.weights[begin:end], strict=True)
        ]
        kept = [(bone, weight) for bone, weight in entries if bone >= 0]
        deforms = sum(float(weight) for _bone, weight in kept) > 1e-4
        found.append([entry for entry in kept if entry[1] > 0] if deforms else [])
    return found


def test_influences_equal_a_loop_over_the_entries():
    for seed in range(4):
        for bone_of_group in (np.arange(5, dtype=np.int32), np.array([3, -1, 0, 1, -1], dtype=np.int32)):
            groups = random_groups(seed, zeros=seed % 2 == 0)
            influences = entries_of_bones(groups, bone_of_group).influences()
            pairs = list(zip(influences.bones.tolist(), influences.weights, strict=True))
            offsets = influences.offsets
            found = [pairs[begin:end] for begin, end in pairwise(offsets)]
            assert found == in_a_loop(groups, bone_of_group)


def test_arrays_are_shared_where_nothing_is_dropped():
    groups = random_groups(1, zeros=False)
    entries = entries_of_bones(groups, np.arange(5, dtype=np.int32))
    influences = entries.influences()
    assert entries.weights is groups.weights
    assert entries.counts is groups.counts
    assert influences.bones is entries.bones
    assert influences.weights is groups.weights


def test_distance_of_influences_is_the_largest_difference_of_a_weight():
    def of(*rows):
        counts = [len(row) for row in rows]
        pairs = [pair for row in rows for pair in row.items()]
        return Influences(
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
            np.array([bone for bone, _weight in pairs], np.int32),
            np.array([weight for _bone, weight in pairs], np.float32),
        )

    first = of({0: 0.5, 2: 0.5}, {}, {1: 1.0})
    assert first.distance_from(of({2: 0.5, 0: 0.5}, {}, {1: 1.0})) == 0.0
    assert first.distance_from(of({0: 0.5, 2: 0.25}, {}, {1: 1.0})) == 0.25
    assert first.distance_from(of({0: 0.5, 2: 0.5}, {4: 0.125}, {1: 1.0})) == 0.125
    assert of({}, {}).distance_from(of({}, {})) == 0.0
