# SPDX-License-Identifier: GPL-3.0-or-later
"""On Windows, Blender processes do not outlive their batch. tests/blender/test_batch.py tests this on
Linux."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "win32", reason="Windows alone has job objects")

# Counts in a file until the process is ended.
CHILD = """
import sys, time
for count in range(300):
    open(sys.argv[1], "w").write(str(count))
    time.sleep(0.1)
"""
PARENT = """
import subprocess, sys, time
from sinew_addon.core.windows_job import end_with_this_process
child = subprocess.Popen([sys.executable, "-c", sys.argv[2], sys.argv[1]])
if sys.argv[3] == "together":
    end_with_this_process(child)
time.sleep(120)
"""


def counted_after_a_kill(path: Path, how: str) -> bool:
    parent = subprocess.Popen([sys.executable, "-c", PARENT, str(path), CHILD, how])
    end = time.monotonic() + 60
    while not (path.exists() and path.read_text() not in ("", "0")):
        assert time.monotonic() < end, "the child did not start"
        time.sleep(0.1)
    parent.kill()
    parent.wait()
    time.sleep(1.0)
    before = path.read_text()
    time.sleep(2.0)
    return path.read_text() != before


def test_a_child_ends_with_its_parent(tmp_path):
    assert not counted_after_a_kill(tmp_path / "together", "together")
    assert counted_after_a_kill(tmp_path / "alone", "alone"), "it would have ended anyway"
