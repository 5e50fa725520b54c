# SPDX-License-Identifier: GPL-3.0-or-later
"""A short walk; `./dev walk` goes further. Planted faults are found and reduced."""

from __future__ import annotations

import runpy

import pytest
import walk

STEPS = 250


def steps_of(*names: str) -> list[walk.Step]:
    return [walk.Step(name, number, True, True) for number, name in enumerate(names)]


@pytest.mark.parametrize("route", walk.ROUTES)
def test_random_operations_leave_both_blenders_alike(route, tmp_path):
    outcomes = walk.run(1, STEPS, tmp_path, (route,), seconds=60.0)
    print(walk.summarise(outcomes, 1.0))
    assert not [outcome.script.read_text() for outcome in outcomes if outcome.fault is not None]
    assert sum(outcome.compared for outcome in outcomes) > STEPS


def test_every_operation_is_chosen():
    weights = walk.operation_weights()
    chosen = {step.operation for seed in range(60) for step in walk.make_steps(seed, 120, weights)}
    assert chosen == {name for name, weight in weights.items() if weight}
    assert len(chosen) >= 35
    assert walk.make_steps(3, 50, weights) == walk.make_steps(3, 50, weights)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planted", "kind"),
    [
        ("plant_shape", "shape"),
        ("plant_state", "state"),
        ("plant_exception", "exception: ValueError"),
        ("plant_crash", "crash of sinew"),
    ],
)
@pytest.mark.once
def test_what_is_planted_is_found_and_made_small(planted, kind, tmp_path, capsys):
    steps = steps_of("frame", "pose", "weights", planted, "frame", "pose")
    with walk.Pair("evaluation") as pair:
        outcome = walk.walk(pair, 0, steps)
        assert outcome.fault is not None
        assert outcome.fault.kind.startswith(kind)
        assert outcome.fault.step == 3
        small = walk.shrink(pair, outcome)
        assert [step.operation for step in small.steps] == [planted]
        script = walk.save(pair, small, tmp_path)
    steps = runpy.run_path(str(script))["STEPS"]
    assert walk.replay(steps, "evaluation") == 1
    assert kind in capsys.readouterr().out
