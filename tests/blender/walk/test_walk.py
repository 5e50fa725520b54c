# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects all that a random walk finds, by a short one; `./dev walk` goes further."""

from __future__ import annotations

import pytest
import walk

STEPS = 250


@pytest.mark.parametrize("route", walk.ROUTES)
def test_random_operations_leave_both_blenders_alike(route, tmp_path):
    outcomes = walk.run(1, STEPS, tmp_path, (route,), seconds=60.0)
    print(walk.summarise(outcomes, 1.0))
    assert not [outcome.script.read_text() for outcome in outcomes if outcome.fault is not None]
    assert sum(outcome.compared for outcome in outcomes) > STEPS
