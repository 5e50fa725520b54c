# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects that sinew.DeltaMush can be bound anew; C++ tests, the fuzzer and the golden set have oracles."""

import numpy as np
import pytest
import sinew
from calls import FACES, SHEET


@pytest.mark.parametrize(
    "settings", [{}, {"radius": 0.2}, {"smooth_type": "length_weighted", "factor": 0.3}], ids=str
)
def test_binding_again_equals_a_new_one(settings):
    mush = sinew.DeltaMush(SHEET, **FACES, iterations=9, weights=np.full(4, 0.5))
    mush.bind(2 * SHEET, **settings)
    made = sinew.DeltaMush(2 * SHEET, **FACES, **settings)
    np.testing.assert_array_equal(mush.apply(SHEET[::-1]), made.apply(SHEET[::-1]))
    assert repr(mush) == repr(made) == f"<sinew.DeltaMush: 4 vertices, {made.iterations} iterations>"


@pytest.mark.parametrize("scale", [np.nan, np.inf])
def test_a_scale_that_is_not_finite_is_refused(scale):
    with pytest.raises(ValueError, match="scale: expected a finite number"):
        sinew.DeltaMush(SHEET, **FACES).apply(SHEET, scale=scale)
