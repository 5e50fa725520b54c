# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel, the menus and the shortcuts in a real window, by clicks and keys: panel_in_window.py does it."""

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
SCRIPTS = (
    REPOSITORY / "docs" / "window.py",
    *(HERE / f"{name}.py" for name in ("window_scene", "five_meshes", "panel_in_window")),
)


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
        [program, "run", *options, "panel_in_window.py", "--", "sinew.zip", "."],
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
    found = json.loads(lines[0][6:])
    output = run.stdout + run.stderr
    found["printed"] = [line for line in output.splitlines() if "Traceback" in line or "Error:" in line]
    return found


def test_five_meshes_need_one_click_for_a_method(facts):
    assert facts["added"] == ["lbs"] * 5
    assert facts["chosen"] == ["dq"] * 5


def test_each_click_is_one_step_of_undo(facts):
    assert facts["switched off"] == [False] * 5
    assert facts["on again"] == [True] * 5
    assert facts["chosen undone"] == ["lbs"] * 5
    assert facts["added undone"] == [""] * 5


def test_f3_finds_operators_without_developer_extras(facts):
    assert facts["added by search"] == ["lbs"] * 5
    assert facts["switched by search"] == [False] * 5


def test_a_shortcut_and_f3_flip_the_comparison(facts):
    assert facts["flipped"] == ["FLIP", False]
    assert facts["flipped by search"] is True


def test_shortcuts_and_menus_go_with_the_add_on(facts):
    assert facts["shortcuts"] == ["sinew.flip_comparison ", "wm.call_menu_pie SINEW_MT_pie"]
    assert facts["shortcuts afterwards"] == []
    assert facts["menus afterwards"] == []


def test_plain_clicks_choose_what_is_compared_and_the_view_shows_it(facts):
    """Linear blend, dual and vector quaternions were chosen; a click takes one away, another adds one."""
    assert facts["compared"] == ["dq", "lbs", "log"]
    assert facts["copies in view"] is True


def test_the_button_above_the_modifiers_opens_the_tab(facts):
    assert facts["tab"] == [True, "Sinew"]


def test_panels_print_no_errors(facts):
    assert facts["printed"] == []
