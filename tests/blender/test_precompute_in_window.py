# SPDX-License-Identifier: GPL-3.0-or-later
"""Centres of rotation are found beside the work in a real window: precompute_in_window.py does it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import bpy
import pytest
from conftest import REPOSITORY

HERE = Path(__file__).parent
SCRIPTS = (REPOSITORY / "docs" / "window.py", HERE / "window_scene.py", HERE / "precompute_in_window.py")
TOLERANCE = 2e-5


@pytest.fixture(scope="module")
def facts(tmp_path_factory) -> dict:
    program, package = os.environ.get("SINEW_FULL_BLENDER"), os.environ.get("SINEW_PACKAGE")
    if not (program and package):
        pytest.skip("SINEW_FULL_BLENDER or SINEW_PACKAGE is not set: no Blender with a window is tested")
    if bpy.app.version < (5, 2):
        pytest.skip("tested once, beside bpy 5.2: it is a Blender of its own")
    folder = tmp_path_factory.mktemp("window")
    shutil.copy(package, folder / "sinew.zip")
    for script in SCRIPTS:
        shutil.copy(script, folder)
    options = ("--factory-startup", "--enable-event-simulate", "--python-exit-code", "3", "--python")
    run = subprocess.run(
        [program, "run", *options, "precompute_in_window.py", "--", "sinew.zip", "."],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
        env={**os.environ, "BLENDER_USER_RESOURCES": str(folder / "user"), "SCREEN": "1280x800"},
    )
    lines = [line for line in run.stdout.splitlines() if line.startswith("FACTS ")]
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
    assert lines, run.stdout[-3000:] + run.stderr[-3000:]
    return json.loads(lines[0][6:])


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
