# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender in a process of its own that does one task after the other, watched from here.

Starting Blender takes 0.5 to 2 s, opening a file 10 ms and more: so a process is kept for the next file,
which replaces all of the last one. One that crashes, hangs or grows too large is ended, and the next file
gets a fresh one.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent import futures
from dataclasses import dataclass

from .core.errors import SinewError
from .core.scratch import ScratchFolder

# A file in the folder of a Blender that says what it is doing: an object of JSON, and blanks.
DOING = "doing"
# Environment variable: the processors to start on, where they are told.
PROCESSORS = "SINEW_PROCESSORS"
START_LIMIT = 180.0
# How often a busy process is looked at.
INTERVAL = 0.1
# What worker.py says first.
GREETINGS = (b'{"ready"', b'{"refused"')


class BlenderLost(Exception):  # noqa: N818
    """The process ended, or had to be ended, before the file was done: why, as the end of a sentence."""


class Stopped(Exception):  # noqa: N818
    """The batch is being stopped."""


@dataclass(frozen=True)
class Limits:
    """What one file may take.

    timeout  seconds; 0: any time
    memory   bytes; 0: all there is
    threads  of Blender at a time, where the system can tell it; 0: as many as there are processors
    verbose  show what Blender prints
    """

    timeout: float = 0.0
    memory: int = 0
    threads: int = 0
    verbose: bool = False


class BlenderProcess:
    """One Blender, for one thread at a time: of this Python, or another of the one that this is inside of.

    wait  until it is there; raises SinewError where it can not be started. Otherwise its first task does
    """

    def __init__(self, limits: Limits, wait: bool = True) -> None:
        # Blender keeps a folder there that it leaves behind when it is ended.
        self._folder = ScratchFolder()
        own = str(self._folder.path)
        try:
            self._process = subprocess.Popen(
                _command(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=None if limits.verbose else subprocess.DEVNULL,
                env={**_environment(limits), "TMPDIR": own, "TEMP": own},
                # Ctrl-C in a terminal is for the batch, which ends its Blenders itself.
                start_new_session=True,
            )
        except OSError as error:
            self._folder.remove()
            raise SinewError(f"no Blender can be started: {error.strerror or error}") from None
        self._is_there = False
        # Of what it is busy with, if it is; why it had to be ended.
        self._limits: Limits | None = None
        self._since = 0.0
        self._excess: str | None = None
        # Bytes, when it was looked at last.
        self._size = 0
        self._lock = threading.Lock()
        self._ended = threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()
        self._begin(Limits(START_LIMIT))
        if wait:
            self._greet()

    def run(self, task: dict, limits: Limits) -> dict:
        """What became of the file. Raises BlenderLost; the process is of no more use then."""
        if not self._is_there:
            self._greet()
        self._begin(limits)
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(task).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            raise BlenderLost(self._epitaph()) from None
        return self._answer()

    def follow(self, task: dict, limits: Limits) -> Iterator[dict]:
        """What it says of what it is doing, every INTERVAL s, and at last what run() gives. Raises as that;
        closed before, it ends the process."""
        aside = futures.ThreadPoolExecutor(1)
        outcome = aside.submit(self.run, task, limits)
        aside.shutdown(wait=False)
        try:
            while not futures.wait([outcome], INTERVAL).done:
                yield self._said()
        finally:
            if not outcome.done():
                self.end()
        yield outcome.result()

    def is_spent(self, limits: Limits) -> bool:
        """Whether the next file had better have a fresh process: what Blender does not give back adds up."""
        return self._excess is not None or 0 < limits.memory / 2 < self._size

    def end(self) -> None:
        """Ends the process by force: an idle one has nothing to lose, and takes 0.2 s to end by itself."""
        self._process.kill()
        self._bury()

    def _begin(self, limits: Limits) -> None:
        with self._lock:
            self._limits, self._since = limits, time.monotonic()

    def _greet(self) -> None:
        answer = self._answer()
        self._is_there = True
        if "refused" in answer:
            self.end()
            raise SinewError(answer["refused"])

    def _answer(self) -> dict:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        # Before the worker is there, Blender and what it runs at its start print what they like.
        while line and not self._is_there and not line.startswith(GREETINGS):
            line = self._process.stdout.readline()
        with self._lock:
            self._limits = None
        if not line.endswith(b"\n"):
            raise BlenderLost(self._epitaph())
        return json.loads(line)

    def _watch(self) -> None:
        """Ends the process where a file takes more than it may."""
        while not self._ended.wait(INTERVAL):
            # Either this or the file's end comes first: what was done in time is not lost.
            with self._lock:
                if self._limits is not None:
                    self._excess = self._found_excess(self._limits)
                if self._excess is not None:
                    self._process.kill()
                    return

    def _found_excess(self, limits: Limits) -> str | None:
        if limits.timeout and time.monotonic() > self._since + limits.timeout:
            return f"no end after {limits.timeout:g} s while {self._doing()}"
        if limits.memory:
            self._size = self._memory()
        if 0 < limits.memory < self._size:
            return f"needed more than {limits.memory / 2**20:,.0f} MiB of memory while {self._doing()}"
        return None

    def _epitaph(self) -> str:
        status = self._process.wait()
        try:
            how = signal.Signals(-status).name
        except ValueError:
            how = f"status {status}"
        doing = self._doing()
        self._bury()
        return self._excess or f"Blender crashed ({how}) while {doing}"

    def _bury(self) -> None:
        self._process.wait()
        self._ended.set()
        self._folder.remove()

    def _doing(self) -> str:
        return self._said().get("doing", "starting")

    def _said(self) -> dict:
        """Its task as "doing", and how far it is; nothing before its first word."""
        with contextlib.suppress(OSError, ValueError):
            return json.loads((self._folder.path / DOING).read_bytes())
        return {}

    def _memory(self) -> int:
        import psutil

        try:
            return psutil.Process(self._process.pid).memory_info().rss
        except psutil.Error:
            return 0


_started = itertools.count()


def _command() -> list[str]:
    bpy, package = sys.modules.get("bpy"), __package__
    if bpy is None or not bpy.app.binary_path:
        return [sys.executable, "-m", f"{package}.worker"]
    as_here = ["--factory-startup"] if bpy.app.factory_startup else []
    # The user's preferences as saved need not have it on.
    with_sinew = ["--addons", package, "--python-expr", f"from {package}.worker import main; main()"]
    return [bpy.app.binary_path, "--background", *as_here, "--python-exit-code", "1", *with_sinew]


def _environment(limits: Limits) -> dict[str, str]:
    """As of this process, with what `limits` says of threads."""
    if not limits.threads:
        return dict(os.environ)
    # Mesa's OpenGL without graphics hardware has threads, too: 0 are faster than 1.
    drawing = {"LP_NUM_THREADS": str(limits.threads if limits.threads > 1 else 0)}
    return {**drawing, **os.environ, PROCESSORS: " ".join(map(str, _first_processors(limits)))}


def _first_processors(limits: Limits) -> list[int]:
    """Those to start a Blender on, each on others: it makes a thread for each that it may use then."""
    if not hasattr(os, "sched_getaffinity"):
        return []
    there = sorted(os.sched_getaffinity(0))
    first = limits.threads * next(_started)
    return [there[(first + index) % len(there)] for index in range(min(limits.threads, len(there)))]
