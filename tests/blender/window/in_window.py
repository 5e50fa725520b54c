# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a script once in the window of a whole Blender with the zip installed, and reads what it prints."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import bpy
import pytest
from conftest import IS_NEWEST, REPOSITORY
from program import ran

HERE = Path(__file__).parent


def program_and_package() -> tuple[str, str]:
    """The whole Blender and the zip; skips the test without them."""
    program, package = os.environ.get("SINEW_FULL_BLENDER"), os.environ.get("SINEW_PACKAGE")
    if not (program and package):
        pytest.skip("SINEW_FULL_BLENDER or SINEW_PACKAGE is not set: no Blender with a window is tested")
    if not IS_NEWEST or bpy.app.version < (5, 2):
        pytest.skip("tested once, beside the newest bpy: it is a Blender of its own")
    return program, package


def facts_of(script: str, folder: Path, *others: str) -> dict:
    """The facts that a script here prints as JSON after FACTS, and its lines of errors as "printed".

    others  names of further scripts that it imports, besides window and window_scene
    """
    program, package = program_and_package()
    shutil.copy(package, folder / "sinew.zip")
    shutil.copy(REPOSITORY / "tools" / "pictures" / "window.py", folder)
    for name in ("window_scene", *others, script):
        shutil.copy(HERE / f"{name}.py", folder)
    options = ("--factory-startup", "--enable-event-simulate", "--python-exit-code", "3", "--python")
    words = program, "run", *options, f"{script}.py", "--", "sinew.zip", "."
    env = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "user"), "SCREEN": "1280x800"}
    run = ran(*words, cwd=folder, timeout=900, env=env)
    output = run.stdout + run.stderr
    lines = [line for line in run.stdout.splitlines() if line.startswith("FACTS ")]
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
    assert lines, run.stdout[-3000:] + run.stderr[-3000:]
    # Blender prints this, too, where undo removes a colour attribute that a view shows and no operator of
    # Sinew made.
    lines_of_errors = (line for line in output.splitlines() if "Not freed memory" not in line)
    printed = [line for line in lines_of_errors if "Traceback" in line or "Error:" in line]
    return json.loads(lines[0][6:]) | {"printed": printed}
