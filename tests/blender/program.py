# SPDX-License-Identifier: GPL-3.0-or-later
"""The program `sinew`, run as a user does."""

from __future__ import annotations

import os
import subprocess
import sys

COMMAND = [sys.executable, "-c", "from sinew_addon.cli import run; run()"]
ENVIRONMENT = {**os.environ, "PYTHONIOENCODING": "utf-8"}


def start_sinew(*args: object, **options: object) -> subprocess.Popen:
    """options  of subprocess.Popen, such as its pipes"""
    return subprocess.Popen([*COMMAND, *map(str, args)], env=ENVIRONMENT, **options)


def run_sinew(*args: object, status: int = 0) -> subprocess.CompletedProcess:
    result = subprocess.run(
        [*COMMAND, *map(str, args)],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=300,
        check=False,
        env=ENVIRONMENT,
    )
    assert result.returncode == status, result.stdout + result.stderr
    assert "Traceback" not in result.stderr, result.stderr
    return result
