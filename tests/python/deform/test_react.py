# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what an event means for an object, as a table without Blender: what is read, planned and shown."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace

import pytest
from sinew_addon.deform.plan import UNSEEN, Plan, State
from sinew_addon.deform.react import Action, Facts, Known, react

EVALUATION = Plan(State.IN_DEPSGRAPH)
UPDATE = Plan(State.AFTER_UPDATE, "Safe mode", in_buffer=True, after_update=True)
WAITING = replace(UPDATE, state=State.WAITING)
BUILT_IN, EDITING = Plan(State.BUILT_IN, "Small"), Plan(State.EDITING)
SEEN, PLANNED, SETTLED = {"is_bound": True}, {"is_planned": True}, {"is_settled": True}

TABLE = [
    # An object of which nothing was read.
    (UNSEEN, {}, {}, Action.REPLAN),
    (UNSEEN, {}, {"may_change": False}, Action.NOTHING),
    (EDITING, {}, {}, Action.REPLAN),
    (EDITING, PLANNED, {}, Action.NOTHING),
    (EVALUATION, PLANNED, {}, Action.REBIND),
    (EVALUATION, PLANNED, {"is_upstream_there": False}, Action.NOTHING),
    # One that was read: nothing to do.
    (EVALUATION, SEEN, {"is_untouched": True}, Action.NOTHING),
    (EVALUATION, SEEN, {"has_shape": True}, Action.NOTHING),
    # Something calls for a new plan.
    (EVALUATION, SEEN, {"is_due": True, "is_untouched": True}, Action.REPLAN),
    (EVALUATION, SEEN, {"is_prevented": True, "is_untouched": True}, Action.REPLAN),
    (EVALUATION, SEEN, {"is_detached": True, "is_untouched": True}, Action.REPLAN),
    (EVALUATION, SEEN, {"was_skipped": True, "is_untouched": True}, Action.REPLAN),
    (EVALUATION, SEEN, {"lacks_points": True, "has_shape": True}, Action.REPLAN),
    (EVALUATION, SEEN, {"is_other": True, "has_shape": True}, Action.REPLAN),
    (EVALUATION, SEEN, {"is_other": True, "may_change": False}, Action.SETTLE),
    (EVALUATION, SEEN, {"is_prevented": True, "may_change": False}, Action.NOTHING),
    # What is read again.
    (EVALUATION, SEEN, {}, Action.SETTLE),
    (EVALUATION, SEEN, {"has_other_mesh": True}, Action.READ),
    (EVALUATION, SEEN, {"has_other_mesh": True, "is_slider_moved": True}, Action.SETTLE),
    (EVALUATION, SEEN, {"has_other_mesh": True, "may_change": False}, Action.READ),
    (EVALUATION, SEEN, {"have_bones_changed": True, "is_slider_moved": True}, Action.READ),
    (EVALUATION, SEEN, {"lacks_surface": True}, Action.READ),
    (EVALUATION, SEEN, {"has_other_modifiers": True}, Action.SETTLE),
    (EVALUATION, SEEN, {"has_other_modifiers": True, "may_change": False}, Action.REBIND),
    (
        EVALUATION,
        {**SEEN, **PLANNED},
        {"has_other_modifiers": True, "have_bones_changed": True},
        Action.REBIND,
    ),
    (EVALUATION, {**SEEN, **PLANNED}, {"is_due": True}, Action.SETTLE),
    (EVALUATION, {**SEEN, **PLANNED, "is_read": True}, {"has_other_mesh": True}, Action.SETTLE),
    (BUILT_IN, {**SEEN, **PLANNED}, {"has_other_mesh": True}, Action.READ),
    (UPDATE, SEEN, {"is_upstream_there": False}, Action.NOTHING),
    # What is shown.
    (EVALUATION, {**SEEN, **SETTLED}, {}, Action.NOTHING),
    (EVALUATION, {**SEEN, **SETTLED, "differs": True}, {}, Action.TAG),
    (EVALUATION, {**SEEN, **SETTLED}, {"was_skipped": True}, Action.TAG),
    (EVALUATION, {**SEEN, **SETTLED}, {"lacks_points": True}, Action.TAG),
    (EVALUATION, {**SEEN, **SETTLED, "differs": True, "is_given": True}, {}, Action.NOTHING),
    (UPDATE, {**SEEN, **SETTLED}, {}, Action.WRITE),
    (WAITING, {**SEEN, **SETTLED}, {}, Action.WRITE),
    (UPDATE, {**SEEN, **SETTLED, "is_given": True}, {}, Action.NOTHING),
    (BUILT_IN, {**SEEN, **SETTLED, "differs": True}, {"was_skipped": True}, Action.NOTHING),
]


@pytest.mark.parametrize(("plan", "known", "facts", "action"), TABLE)
def test_the_table(plan, known, facts, action):
    assert react(Facts(**facts), Known(plan, **known)) is action


def test_every_fact_matters():
    """A fact that no row changes would not need to be observed."""
    assert {name for *_, facts, _action in TABLE for name in facts} == {field.name for field in fields(Facts)}
    known = {name for _plan, known, *_ in TABLE for name in known}
    assert known == {field.name for field in fields(Known)} - {"plan"}


_DONE = {
    Action.REBIND: {"is_bound": True, "is_read": True},
    Action.READ: {"is_read": True},
    Action.SETTLE: {"is_settled": True, "differs": True},
    Action.TAG: {"is_given": True},
    Action.WRITE: {"is_given": True},
}


@pytest.mark.parametrize("after", [EVALUATION, UPDATE, BUILT_IN, EDITING])
def test_each_event_ends_and_does_nothing_twice(after):
    """Whatever the facts are: at most one plan, one reading and one shape."""
    names = [field.name for field in fields(Facts)]
    for chosen in itertools.chain.from_iterable(itertools.combinations(names, n) for n in range(4)):
        facts = Facts(**{name: not getattr(Facts(), name) for name in chosen})
        for is_bound in (False, True):
            known, done = Known(EVALUATION if is_bound else UNSEEN, is_bound=is_bound), []
            while (action := react(facts, known)) is not Action.NOTHING:
                done.append(action)
                assert len(done) <= 4
                plan = {"is_planned": True, "plan": after} if action is Action.REPLAN else _DONE[action]
                known = replace(known, **plan)
            order = [Action.REPLAN, Action.REBIND, Action.READ, Action.SETTLE, Action.TAG, Action.WRITE]
            assert done == sorted(set(done), key=order.index)
            assert (Action.REPLAN in done) <= facts.may_change
