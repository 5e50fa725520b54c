# SPDX-License-Identifier: GPL-3.0-or-later
"""The golden set equals what this Blender computes."""

from __future__ import annotations

import json

import make_golden
import numpy as np
import pytest

pytestmark = pytest.mark.long_term


@pytest.mark.parametrize("set_up", make_golden.CASES, ids=lambda case: case.__name__)
def test_current(set_up):
    about, arrays = make_golden.make(set_up)
    path = make_golden.FOLDER / set_up.__name__
    stored_about = json.loads(path.with_suffix(".json").read_text())
    stored = dict(np.load(path.with_suffix(".npz")))
    assert {**stored_about, "blender": about["blender"]} == about
    extent = np.linalg.norm(np.ptp(arrays["points"], axis=0))
    for name, array in arrays.items():
        np.testing.assert_allclose(stored[name], array, rtol=0.0, atol=2e-6 * extent, err_msg=name)
