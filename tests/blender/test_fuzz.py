# SPDX-License-Identifier: GPL-3.0-or-later
"""The first rigs of the fuzzer; `./dev fuzz` runs more."""

from __future__ import annotations

import fuzz_parity
import pytest
import routes
import scenes
from sinew_addon.attach import attach, properties
from sinew_addon.deform import session, small_meshes

RIGS = 300


@pytest.fixture(autouse=True)
def any_route(none_left_to_blender):
    yield
    routes.release()


def test_random_rigs_equal_the_modifier(tmp_path):
    outcomes = fuzz_parity.run(0, RIGS, tmp_path)
    print(fuzz_parity.summarise(outcomes))
    assert not [outcome.seed for outcome in outcomes if outcome.failed]
    # An exclusion that grew would hide what it is there to let pass.
    assert sum(o.left_out for o in outcomes) < 0.005 * sum(o.vertices for o in outcomes)
    # Rigs that can not be deformed within the evaluation are the fewer, and in safe mode none is.
    within = sum(o.taken[routes.EVALUATION] == routes.EVALUATION for o in outcomes)
    assert within > 0.3 * RIGS
    assert all(o.taken[routes.UPDATE] == routes.UPDATE for o in outcomes)


def test_every_feature_takes_part():
    for feature in fuzz_parity.FEATURES:
        share = sum(fuzz_parity.has(seed, feature, set(fuzz_parity.FEATURES)) for seed in range(RIGS)) / RIGS
        assert share > 0.1, feature


def test_a_shape_that_blender_made_is_a_failure(monkeypatch):
    """What had the fuzzer compare Blender with itself: small meshes are left to the modifier."""
    force = routes.force

    def force_and_leave_small(route: str) -> None:
        force(route)
        small_meshes.is_used = True

    monkeypatch.setattr(routes, "force", force_and_leave_small)
    outcome = fuzz_parity.check(0, set())
    assert outcome.failed
    assert "not deformed" in outcome.reason or "is on" in outcome.reason


def test_a_shape_of_another_pose_is_not_taken_for_this_one():
    obj, _armature = scenes.make_arm()
    routes.force(routes.EVALUATION)
    scenes.add_sinew(obj)
    state = session.state_of(obj)
    with pytest.raises(routes.NotBySinewError, match="for this pose"):
        routes.taken(obj, state.shown.number)
    properties.of(obj).enabled = False
    with pytest.raises(routes.NotBySinewError, match="off"):
        routes.taken(obj, -1)
    attach.remove(obj)
