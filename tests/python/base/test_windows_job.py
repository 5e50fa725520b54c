# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects Windows: Blender processes do not outlive their batch. tests/blender/jobs/test_batch.py tests this
on Linux."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import psutil
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
from sinew_addon.base.windows_job import end_with_this_process
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


# Starts one child after the other until it is ended, each of which would stay for a minute.
STARTER = """
import subprocess, sys
from sinew_addon.base.windows_job import end_all_with_this_process
end_all_with_this_process()
print("ready", flush=True)
while True:
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
"""


def test_a_child_that_has_just_begun_to_start_ends_with_its_parent():
    choose = random.Random(5)
    for _ in range(6):
        parent = subprocess.Popen([sys.executable, "-c", STARTER], stdout=subprocess.PIPE)
        assert parent.stdout.readline().startswith(b"ready")
        children: list[psutil.Process] = []
        while not children:
            children = psutil.Process(parent.pid).children()
        time.sleep(choose.uniform(0.0, 0.3))
        children = psutil.Process(parent.pid).children()
        parent.kill()
        parent.wait()
        # Not read to its end: a child that stays may have the other end.
        parent.stdout.close()
        _gone, left = psutil.wait_procs(children, timeout=10)
        assert left == []
        # Those that began since; the system lists a process for a moment after its end.
        end = time.monotonic() + 10
        while left := [process for process in psutil.process_iter() if parent.pid == parent_of(process)]:
            assert time.monotonic() < end, left
            time.sleep(0.1)


def parent_of(process: psutil.Process) -> int | None:
    """None of one that has just ended."""
    try:
        return process.ppid()
    except psutil.Error:
        return None
