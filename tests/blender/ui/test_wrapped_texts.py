# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts of panels in lines of the width that there is, as Blender wraps none."""

from __future__ import annotations

from itertools import pairwise

import pytest
from sinew_addon.ui import sidebar

pytestmark = pytest.mark.long_term

TEXT = (
    "In Edit Mode, move the bone's head into the middle of the limb, as an Iterative Dual Quaternion would."
)


@pytest.mark.parametrize("width", [100.0, 150.0, 216.0, 1000.0])
def test_lines_fit_and_have_all_words(width):
    lines = list(sidebar._lines(TEXT, width))
    assert " ".join(lines) == TEXT
    assert max(map(sidebar._width, lines)) <= width
    # No word of the next line would have fitted.
    for line, following in pairwise(lines):
        assert sidebar._width(f"{line} {following.split()[0]}") > width


def test_a_name_that_is_longer_than_a_line_loses_its_middle():
    first, name, last = sidebar._lines(f"Of {'Character' * 9}_low.003 alone", 120.0)
    assert (first, last) == ("Of", "alone")
    assert name.startswith("Character")
    assert name.endswith("_low.003")
    assert sidebar._width(name) <= 120.0
