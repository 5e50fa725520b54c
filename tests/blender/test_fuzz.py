# SPDX-License-Identifier: GPL-3.0-or-later
"""The first rigs of the fuzzer; `./dev fuzz` runs more."""

from __future__ import annotations

import fuzz_parity

RIGS = 500


def test_random_rigs_equal_the_modifier(tmp_path):
    outcomes = fuzz_parity.run(0, RIGS, tmp_path)
    print(fuzz_parity.summarise(outcomes))
    assert not [outcome.seed for outcome in outcomes if outcome.failed]
    # An exclusion that grew would hide what it is there to let pass.
    assert sum(o.left_out for o in outcomes) < 0.005 * sum(o.vertices for o in outcomes)


def test_every_feature_takes_part():
    for feature in fuzz_parity.FEATURES:
        share = sum(fuzz_parity.has(seed, feature, set(fuzz_parity.FEATURES)) for seed in range(RIGS)) / RIGS
        assert share > 0.1, feature
