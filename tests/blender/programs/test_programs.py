# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what long programs find, by short runs of each: `./dev fuzz`, `walk`, `soak` and `corpus` go
further; and the golden set, which equals what this Blender computes."""

from __future__ import annotations

import json
import os
import sys

import bpy
import corpus
import fuzz_parity
import make_golden
import numpy as np
import pytest
import routes
import scenes
import soak
import walk
from conftest import IS_NEWEST
from program import ran

# The newest Blender runs the first 100 rigs, each other one 40 different ones: all of them must have the same
# shapes (docs/parity.md), and together they check more rigs.
RIGS = 100 if IS_NEWEST else 40
FIRST = 0 if IS_NEWEST else RIGS * (10 * bpy.app.version[0] + bpy.app.version[1])
# `./dev test` runs these many of them. Of fewer, one rig decides what share of the vertices rounding leaves
# undecided: of the first 15 of 4.2 it is 15 %, of 25 it is 7 %, and of 40 it is 5 %.
QUICK = 25
STEPS = 250


@pytest.fixture
def any_route(small_meshes_as_users_have_them):
    yield
    routes.release()


@pytest.mark.usefixtures("any_route")
def test_random_rigs_equal_the_modifier(tmp_path):
    rigs = RIGS if "SINEW_TEST_ALL" in os.environ else QUICK
    outcomes = fuzz_parity.run(FIRST, rigs, tmp_path)
    print(fuzz_parity.summarise(outcomes))
    assert not [outcome.seed for outcome in outcomes if outcome.failed]
    # An exclusion that covered more vertices would hide faults.
    assert sum(o.left_out for o in outcomes) < 0.01 * sum(o.vertices for o in outcomes)
    # Bones of random rigs are far apart: for ddm, rounding decides the shape of some small neighbourhoods
    # there.
    assert sum(o.undecided for o in outcomes) < 0.08 * sum(o.compared for o in outcomes)
    assert sum(o.undecided_stages for o in outcomes) < 0.1 * sum(o.staged for o in outcomes)
    # Many rigs are deformed within the evaluation, none in safe mode, and few are refused.
    taken = [o.taken for o in outcomes if not o.refused]
    assert len(taken) > 0.7 * rigs
    within = sum(each[routes.EVALUATION] == routes.EVALUATION for each in taken)
    assert within > 0.3 * rigs
    assert all(each[routes.UPDATE] == routes.UPDATE for each in taken)


@pytest.mark.parametrize("route", walk.ROUTES)
def test_random_operations_leave_both_blenders_alike(route, tmp_path):
    outcomes = walk.run(1, STEPS, tmp_path, (route,), seconds=60.0)
    print(walk.summarise(outcomes, 1.0))
    assert not [outcome.script.read_text() for outcome in outcomes if outcome.fault is not None]
    assert sum(outcome.compared for outcome in outcomes) > STEPS


@pytest.mark.parametrize("frames", [40, pytest.param(300, marks=pytest.mark.slow)])
def test_nothing_grows(frames):
    """Memory, handlers, data and states of threads."""
    assert soak.run(frames, threads=60) == []


@pytest.mark.once
@pytest.mark.slow
def test_each_file_is_a_row(tmp_path):
    """Also one that Blender can not read."""
    below = tmp_path / "files" / "below"
    below.mkdir(parents=True)
    scenes.make_arm(sides=6, rings=9)
    scenes.save(below / "arm.blend")
    (below / "broken.glb").write_bytes(b"glTF and nothing else")
    (below / "notes.txt").write_text("no scene")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add()
    scenes.save(below / "cube.blend")
    done = ran(sys.executable, corpus.__file__, below.parent, "--json", tmp_path / "rows.json")
    assert done.returncode == 0, done.stdout + done.stderr
    arm, broken, cube = json.loads((tmp_path / "rows.json").read_text())
    assert arm["by"] == ["evaluation"]
    assert 0.0 < max(arm["worst"].values()) < scenes.TOLERANCE
    assert arm["failures"] == cube["failures"] == []
    assert cube["meshes"] == 0
    assert "can not read it" in broken["error"]
    assert "3 files, 1 that Blender can not read; 1 with skins that Sinew deforms" in done.stdout


@pytest.mark.long_term
@pytest.mark.parametrize("set_up", make_golden.CASES, ids=lambda case: case.__name__)
def test_the_golden_set_is_what_this_blender_computes(set_up):
    about, arrays = make_golden.make(set_up)
    path = make_golden.FOLDER / set_up.__name__
    stored_about = json.loads(path.with_suffix(".json").read_text())
    stored = dict(np.load(path.with_suffix(".npz")))
    assert {**stored_about, "blender": about["blender"]} == about
    extent = np.linalg.norm(np.ptp(arrays["points"], axis=0))
    for name, array in arrays.items():
        np.testing.assert_allclose(stored[name], array, rtol=0.0, atol=2e-6 * extent, err_msg=name)
