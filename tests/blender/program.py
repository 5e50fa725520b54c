# SPDX-License-Identifier: GPL-3.0-or-later
"""The program `sinew`, run as a user runs it, and disks for it to write to."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

# For tests that send SIGINT.
needs_interrupts = pytest.mark.skipif(
    os.name == "nt", reason="Python sends no interrupt to one process of Windows"
)
COMMAND = [sys.executable, "-c", "from sinew_addon.cli import run; run()"]
ENVIRONMENT = {**os.environ, "PYTHONIOENCODING": "utf-8"}


def start_sinew(*args: object, env_more: dict[str, str] | None = None, **options: object) -> subprocess.Popen:
    """options  of subprocess.Popen, such as its pipes"""
    environment = {**ENVIRONMENT, **(env_more or {})}
    return subprocess.Popen([*COMMAND, *map(str, args)], env=environment, **options)


def run_sinew(
    *args: object, status: int = 0, env_more: dict[str, str] | None = None, within: Sequence[str] = ()
) -> subprocess.CompletedProcess:
    """within: words before the program's own command"""
    result = subprocess.run(
        [*within, *COMMAND, *map(str, args)],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=300,
        check=False,
        env={**ENVIRONMENT, **(env_more or {})},
    )
    assert result.returncode == status, result.stdout + result.stderr
    assert "Traceback" not in result.stderr, result.stderr
    return result


@contextmanager
def disk(folder: Path, options: str) -> Iterator[Path]:
    """A disk in memory, mounted at a new folder. Skips the test if mounting is not allowed."""
    if shutil.which("mount") is None:
        pytest.skip("the system mounts no disks in memory")
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode != 0:
        pytest.skip("this process may not mount a disk")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)
