# SPDX-License-Identifier: GPL-3.0-or-later
"""The lesson in a real window: lesson_in_window.py opens it with unsaved changes, and again after saving."""

from __future__ import annotations

import in_window
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def facts(tmp_path_factory) -> dict:
    return in_window.facts_of("lesson_in_window", tmp_path_factory.mktemp("window"))


def test_what_is_not_saved_is_not_lost(facts):
    assert facts["is dirty"] is True
    assert facts["asks first"] is True
    assert facts["kept after Esc"] is True
    assert facts["kept without the question"] is True
    assert "Save this file first" in facts["said"]


def test_what_was_saved_makes_room_for_it(facts):
    """Opened as a file without a name, so that saving does not write to the extension's folder."""
    assert facts["opened"] == [True, "", True]
    assert {"TEXT_EDITOR", "VIEW_3D"} <= set(facts["reading"])
