# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects fits, with 2,000 seeded cases each, compared with 50 digits as
tests/python/library/test_exact.py does."""

import exact_fits
import pytest
from future_work import fit


def test_each_fit_has_a_check():
    assert {name.removeprefix("fit.") for name in exact_fits.CHECKS} == {"average", "hand_eye", "rigid"}


@pytest.mark.parametrize("name", exact_fits.CHECKS)
def test_agrees_with_50_digits(name):
    exact_fits.CHECKS[name]("fit", getattr(fit, name.removeprefix("fit.")))
