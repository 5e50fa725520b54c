# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel, the menus and the shortcuts in a real window, with clicks and keys: see panel_in_window.py."""

from __future__ import annotations

import in_window
import pytest

pytestmark = pytest.mark.window


def test_clicks_and_keys(tmp_path):
    facts = in_window.facts_of("panel_in_window", tmp_path, "five_meshes")
    assert facts["faults"] == []
    assert facts["printed"] == []
