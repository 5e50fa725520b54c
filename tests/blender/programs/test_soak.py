# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects memory, handlers, data and thread states from growing with frames; `./dev soak` runs more."""

from __future__ import annotations

import pytest
import soak


@pytest.mark.parametrize("frames", [40, pytest.param(300, marks=pytest.mark.slow)])
def test_nothing_grows(frames):
    assert soak.run(frames, threads=60) == []
