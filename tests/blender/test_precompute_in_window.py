# SPDX-License-Identifier: GPL-3.0-or-later
"""Centres of rotation are computed in the background of a real window: see precompute_in_window.py."""

from __future__ import annotations

import in_window
import pytest

TOLERANCE = 2e-5


@pytest.fixture(scope="module")
def facts(tmp_path_factory) -> dict:
    return in_window.facts_of("precompute_in_window", tmp_path_factory.mktemp("window"))


def test_the_window_goes_on_meanwhile(facts):
    assert facts["plan_at_first"] == "waiting"
    assert facts["ticks_meanwhile"] >= 3
    assert facts["watched"] == ["SINEW_OT_watch_precomputation"]
    assert facts["off_modifier_meanwhile"] <= TOLERANCE
    assert facts["plan_then"] == "in depsgraph"
    assert facts["off_modifier_then"] > 1e-3


def test_esc_stops_it_and_a_button_goes_on(facts):
    assert facts["plan_stopped"] == "waiting"
    assert "stopped" in facts["reason_stopped"]
    assert facts["plan_after_button"] == "in depsgraph"


def test_a_render_waits_with_the_interface_locked_or_not(facts):
    assert facts["plan_before_render"] == ["waiting", "waiting"]
    assert max(facts["render_off"]) <= TOLERANCE


def test_its_thread_ends_with_the_file_and_with_blender(facts):
    assert facts["running_after_load"] == 0
    assert facts["plan_at_the_end"] == "waiting"
