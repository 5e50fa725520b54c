# SPDX-License-Identifier: GPL-3.0-or-later
"""The program `sinew` and other Blenders: in processes of their own, or in one that stays for all tests."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

# For tests that send SIGINT.
needs_interrupts = pytest.mark.skipif(
    os.name == "nt", reason="Python sends no interrupt to one process of Windows"
)
COMMAND = [sys.executable, "-c", "from sinew_addon.cli import run; run()"]
ENVIRONMENT = {**os.environ, "PYTHONIOENCODING": "utf-8"}


def start_sinew(*args: object, env_more: dict[str, str] | None = None, **options: object) -> subprocess.Popen:
    """options  of subprocess.Popen, such as its pipes: by default all is read as text"""
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    options = {**pipes, "text": True, "encoding": "utf-8", **options}
    return subprocess.Popen([*COMMAND, *map(str, args)], env={**ENVIRONMENT, **(env_more or {})}, **options)


def run_script(path: Path, text: str) -> subprocess.CompletedProcess:
    """Runs a script in a Python of its own, which may import from this folder. It must come to its end, and
    exit with status 0."""
    path.write_text(f"{text}\nprint('at its end')\n")
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    done = ran(sys.executable, "-X", "faulthandler", path, env=env, timeout=120)
    assert "at its end" in done.stdout, done.stdout[-2000:] + done.stderr[-3000:]
    assert done.returncode == 0, done.stderr
    return done


# Runs one script after the other, each with its words in sys.argv. What they print goes to two files, as
# Blender writes to the file descriptors themselves.
SERVE = """
import json, os, sys, traceback
answers = os.fdopen(os.dup(1), "w")
out, err = (open(path, "w+b", buffering=0) for path in sys.argv[1:])
for file, number in ((out, 1), (err, 2)):
    os.dup2(file.fileno(), number)
sys.stdout.reconfigure(encoding="utf-8")
sys.stderr.reconfigure(encoding="utf-8")
own_stderr = sys.stderr
import bpy
for line in sys.stdin:
    for number in (1, 2):
        os.ftruncate(number, 0)
        os.lseek(number, 0, os.SEEK_SET)
    kept = os.dup(1), os.dup(2)
    script, *words = json.loads(line)
    sys.argv[1:] = words
    names = {"__name__": "__main__", "status": 0}
    try:
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        exec(script, names)
    except BaseException:
        traceback.print_exc()
        names["status"] = 1
    sys.stdout.flush()
    sys.stderr.flush()
    sys.stderr = own_stderr
    for number, copy in zip((1, 2), kept):
        os.dup2(copy, number)
        os.close(copy)
    print(names["status"], file=answers, flush=True)
os._exit(0)
"""


class KeptBlender:
    """A Blender that runs scripts one after the other, each in a new file: starting one takes a second."""

    def __init__(self) -> None:
        self._process: subprocess.Popen | None = None

    def run(self, script: str, *words: object) -> subprocess.CompletedProcess:
        """Returns the script's variable `status`, 0 by default, and what it printed."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        print(json.dumps([script, *map(str, words)]), file=self._process.stdin, flush=True)
        answer = self._process.stdout.readline()
        status = int(answer) if answer else self._process.wait(60)
        printed = [path.read_text(encoding="utf-8", errors="surrogateescape") for path in self._printed]
        return subprocess.CompletedProcess(words, status, *printed)

    @property
    def pid(self) -> int | None:
        return None if self._process is None else self._process.pid

    def _start(self) -> None:
        folder = Path(tempfile.mkdtemp(prefix="tests-"))
        self._printed = [folder / "out", folder / "err"]
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVE, *self._printed],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=ENVIRONMENT,
        )
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        # Without Blender's own end as a module, which can crash after an export.
        atexit.register(self._process.kill)


# For files in the hands of those who have no Sinew, and for commands.
without_sinew, with_sinew = KeptBlender(), KeptBlender()


RUN = """
import sys
from sinew_addon import cli
from sinew_addon.deform import characters
characters.set_parameters({})
status = cli.main(sys.argv[1:])
"""


def own_children() -> list[psutil.Process]:
    """The processes that a test has started, without the Blender that stays for others."""
    kept = {without_sinew.pid, with_sinew.pid}
    return [each for each in psutil.Process().children() if each.pid not in kept]


def run_sinew(*args: object, status: int = 0) -> subprocess.CompletedProcess:
    """In the Blender that stays: for tests of what a command does. Its open file is not the test's."""
    return checked(with_sinew.run(RUN, *args), status)


def run_program(
    *args: object, status: int = 0, env_more: dict[str, str] | None = None, within: Sequence[str] = ()
) -> subprocess.CompletedProcess:
    """In a process of its own, as users run it. within: words before the program's own command"""
    return checked(ran(*within, *COMMAND, *args, env=ENVIRONMENT | (env_more or {})), status)


def ran(*words: object, **options: object) -> subprocess.CompletedProcess:
    """Any program, with what it prints. options  of subprocess.run()"""
    options = {"timeout": 300, "encoding": "utf-8", **options}
    return subprocess.run(list(map(str, words)), capture_output=True, check=False, **options)


def checked(result: subprocess.CompletedProcess, status: int) -> subprocess.CompletedProcess:
    assert result.returncode == status, result.stdout + result.stderr
    assert "Traceback" not in result.stderr, result.stderr
    return result


def complaint(errors: str) -> str:
    """The one line that reports the problem."""
    (line,) = [line for line in errors.splitlines() if line.startswith("sinew: ")]
    return line


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
