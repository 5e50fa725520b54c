# SPDX-License-Identifier: GPL-3.0-or-later
"""A fixture for pytest: characters that have to deform well.

pytest_plugins = ["sinew_addon.commands.pytest_flex"]    # in conftest.py

def test_hero(sinew_flex):
    sinew_flex("characters/hero.blend")
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

# The package has another name as an extension.
_PACKAGE = __package__.rpartition(".")[0]


@pytest.fixture
def sinew_flex() -> Callable[..., dict[str, Any]]:
    """sinew_flex(path): fails the test with a line for each fault; returns the report of `sinew flex --json`.

    options  more words of the command, such as ("--methods", "dq,cor")
    known    joints that may fail
    """

    def check(path: str | Path, options: Sequence[str] = (), known: Sequence[str] = ()) -> dict[str, Any]:
        # In a Blender of its own: one that crashes is one failed test.
        program = [sys.executable, "-c", f"from {_PACKAGE}.cli import run; run()", "flex", str(path)]
        done = subprocess.run(
            [*program, "--json", *options], capture_output=True, text=True, encoding="utf-8", check=False
        )
        if not done.stdout:
            pytest.fail(f"{path}: {done.stderr.strip() or f'exit status {done.returncode}'}", pytrace=False)
        report: dict[str, Any] = json.loads(done.stdout)[0]
        reasons = [report["error"]] if "error" in report else report["left_out"]
        for joint in report.get("joints", []):
            if joint["joint"] not in known:
                reasons += [
                    f"{joint['joint']}: {finding['text']} {finding['place']}" for finding in joint["findings"]
                ]
        if reasons:
            pytest.fail("\n".join([f"{path}:", *reasons]), pytrace=False)
        return report

    return check
