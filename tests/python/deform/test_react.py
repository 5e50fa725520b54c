# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what an event means for an object, as tables without Blender: what is planned and read."""

from __future__ import annotations

from dataclasses import fields

import pytest
from sinew_addon.deform.react import Facts, Inputs, Reading, Step, reading_of, step_of

UNREAD, CURRENT = {"is_bound": False}, {"is_up_to_date": True}
STEPS = [
    # An object of which nothing was read.
    (UNREAD, Step.REPLAN),
    ({**UNREAD, "may_change": False}, Step.NOTHING),
    # One that was read.
    (CURRENT, Step.NOTHING),
    ({}, Step.UPDATE),
    ({"may_change": False}, Step.UPDATE),
    # Something calls for a new plan.
    ({**CURRENT, "is_due": True}, Step.REPLAN),
    ({**CURRENT, "is_prevented": True}, Step.REPLAN),
    ({**CURRENT, "is_detached": True}, Step.REPLAN),
    ({**CURRENT, "was_skipped": True}, Step.REPLAN),
    ({**CURRENT, "lacks_points": True}, Step.REPLAN),
    ({**CURRENT, "is_other": True}, Step.REPLAN),
    ({"is_other": True, "may_change": False}, Step.UPDATE),
    ({"is_prevented": True, "may_change": False}, Step.NOTHING),
]
READINGS = [
    ({}, Reading.NOTHING),
    ({"has_other_mesh": True}, Reading.CHANGED),
    ({"has_other_mesh": True, "is_slider_moved": True}, Reading.NOTHING),
    ({"has_other_mesh": True, "is_slider_moved": True, "lacks_surface": True}, Reading.CHANGED),
    ({"have_bones_changed": True, "is_slider_moved": True}, Reading.CHANGED),
    ({"lacks_surface": True}, Reading.CHANGED),
    ({"has_other_modifiers": True, "have_bones_changed": True}, Reading.ALL),
]


@pytest.mark.parametrize(("facts", "step"), STEPS)
def test_what_an_event_is_answered_with(facts, step):
    assert step_of(Facts(**facts)) is step


@pytest.mark.parametrize(("inputs", "reading"), READINGS)
def test_what_is_read(inputs, reading):
    assert reading_of(Inputs(**inputs)) is reading


@pytest.mark.parametrize(("table", "facts"), [(STEPS, Facts), (READINGS, Inputs)])
def test_every_fact_matters(table, facts):
    """A fact that no row changes would not need to be observed."""
    assert {name for row, _result in table for name in row} == {field.name for field in fields(facts)}
