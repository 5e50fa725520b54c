# SPDX-License-Identifier: GPL-3.0-or-later
"""A run in the real window: window_run.py does in a whole Blender what artists do, with the zip installed
as they install it, and compares the shapes after each step. A Blender without Sinew reads the saved
files."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import in_window
import pytest
from conftest import REPOSITORY
from program import ran

pytestmark = pytest.mark.window

SCRIPTS = (REPOSITORY / "tools/pictures/window.py", *Path(__file__).parent.glob("window_*.py"))
OPTIONS = ("--enable-event-simulate", "--python-exit-code", "3", "--python")
# Two Blenders at a time. The second one is restarted with what it saved last.
FIRST = ("files", "undo", "windows", "modes")
SECOND = ("objects", "renders", "addon", "quit")
AGAIN = ("again",)
# What `./dev test` runs; `./dev test --all` runs every group.
QUICK = ("files", "undo", "modes")


@dataclass
class Results:
    """The faults by step: in the window, and in the files that the step saved."""

    steps: list[str] = field(default_factory=list)
    shown: dict[str, list[str]] = field(default_factory=dict)
    saved: dict[str, list[str]] = field(default_factory=dict)
    printed: dict[str, list[str]] = field(default_factory=dict)
    ended: dict[str, str] = field(default_factory=dict)


@pytest.fixture(scope="module")
def results(request, tmp_path_factory) -> Results:
    """Of the groups that chosen tests are about."""
    program, package = in_window.program_and_package()
    found = Results()
    folders = [tmp_path_factory.mktemp(name) for name in ("first", "second")]
    for folder in folders:
        shutil.copy(package, folder / "sinew.zip")
        for script in SCRIPTS:
            shutil.copy(script, folder)

    items = [item for item in request.session.items if item.path == request.path]
    chosen = {item.callspec.params["group"] for item in items}

    def first() -> None:
        if groups := tuple(group for group in FIRST if group in chosen):
            _run(program, folders[0], groups, found)

    def second() -> None:
        # It is restarted with what its last group saves.
        groups = SECOND if chosen & {*AGAIN} else tuple(group for group in SECOND if group in chosen)
        if groups:
            _run(program, folders[1], groups, found)
        if chosen & {*AGAIN}:
            _run(program, folders[1], AGAIN, found)

    with ThreadPoolExecutor(2) as both:
        for future in [both.submit(first), both.submit(second)]:
            future.result()
    return found


def _run(program: str, folder: Path, groups: tuple[str, ...], found: Results) -> None:
    # First with factory settings, then with the artist's preferences.
    start = ["out/last.blend"] if groups == AGAIN else ["--factory-startup"]
    output = folder / f"{groups[-1]}.log"
    with output.open("w") as log:
        status = subprocess.run(
            [program, "run", *start, *OPTIONS, "window_run.py", "--", "sinew.zip", "out", *groups],
            cwd=folder,
            stdout=log,
            stderr=subprocess.STDOUT,
            timeout=1200,
            check=False,
            # A small screen, since drawing takes most of the time.
            env={**os.environ, "BLENDER_USER_RESOURCES": str(folder / "user"), "SCREEN": "1000x640"},
        ).returncode
    text = output.read_text(errors="replace")
    step = ""
    for line in text.splitlines():
        if line.startswith("STEP "):
            step = line[5:]
            found.steps.append(step)
        elif line.startswith("FAULT "):
            name, _colon, fault = line[6:].partition(" | ")
            found.shown.setdefault(name, []).append(fault)
        elif line.startswith("Traceback") or "Error:" in line:
            found.printed.setdefault(step, []).append(line)
    if status != 0 or "ENDED" not in text:
        for group in groups:
            found.ended[group] = f"exit status {status} in {step}:\n{text[-2000:]}"
    manifest = folder / "out" / f"saved-{groups[-1]}.json"
    if manifest.exists():
        read = ran(sys.executable, Path(__file__).with_name("window_read.py"), manifest)
        lines = [line for line in read.stdout.splitlines() if line.startswith("FAULTS ")]
        assert lines, read.stdout + read.stderr
        found.saved |= json.loads(lines[0][7:])


def _of(group: str, faults: dict[str, list[str]]) -> dict[str, list[str]]:
    return {step: texts for step, texts in faults.items() if step.partition(":")[0] == group}


# Errors of another add-on.
PRINTING = ("renders: others_throw",)


def _groups(*left_out: str) -> pytest.MarkDecorator:
    chosen = [group for group in FIRST + SECOND + AGAIN if group not in left_out]
    marked = [group if group in QUICK else pytest.param(group, marks=pytest.mark.slow) for group in chosen]
    return pytest.mark.parametrize("group", marked)


@_groups()
def test_shows_the_right_shapes(results, group):
    assert _of(group, results.shown) == {}
    assert group not in results.ended, results.ended[group]
    assert [step for step in results.steps if step.startswith(f"{group}:")]


@_groups("addon")
def test_saves_what_works_without_sinew(results, group):
    assert _of(group, results.saved) == {}


@_groups()
def test_prints_no_errors(results, group):
    printed = _of(group, results.printed)
    assert {step: lines for step, lines in printed.items() if step not in PRINTING} == {}
