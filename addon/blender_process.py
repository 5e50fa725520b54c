# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender in a process of its own that does one task after the other, watched from here.

Starting Blender takes 0.5 to 2 s, opening a file 10 ms and more: so a process is kept for the next file,
which replaces all of the last one. One that crashes, hangs or grows too large is ended, and the next file
gets a fresh one.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import dropwhile

from .core.errors import SinewError

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
    verbose  show what Blender prints
    """

    timeout: float = 0.0
    memory: int = 0
    verbose: bool = False


class BlenderProcess:
    """One Blender: of this Python, or another of the one that this is inside of.

    wait  until it is there; raises SinewError where it can not be started. Otherwise its first task does
    """

    def __init__(self, limits: Limits, wait: bool = True) -> None:
        # Blender keeps a folder there that it leaves behind when it is ended.
        self._folder = tempfile.TemporaryDirectory(prefix="sinew-", ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            _command(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if limits.verbose else subprocess.DEVNULL,
            env={**os.environ, "TMPDIR": self._folder.name, "TEMP": self._folder.name},
            # Ctrl-C in a terminal is for the batch, which ends its Blenders itself.
            start_new_session=True,
        )
        self._messages: queue.SimpleQueue[dict | None] = queue.SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()
        self._doing = "starting"
        if wait:
            next(message for message in self._heard(Limits(START_LIMIT)) if message)

    def run(self, task: dict, limits: Limits) -> dict:
        """What became of the file. Raises BlenderLost; the process is of no more use then."""
        for message in self.follow(task, limits):
            outcome = message
        return outcome

    def follow(self, task: dict, limits: Limits) -> Iterator[dict | None]:
        """What is told of a task, its outcome last; None where INTERVAL passes without. Raises as run()."""
        self._doing = "starting on it"
        try:
            self._process.stdin.write(json.dumps(task).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            raise BlenderLost(self._epitaph()) from None
        for message in self._heard(limits):
            yield message
            if message is not None and not message.keys() & {"doing", "ready"}:
                return

    def has_grown(self, limits: Limits) -> bool:
        """Whether the next file had better have a fresh process: what Blender does not give back adds up."""
        return bool(limits.memory) and self._memory() > limits.memory / 2

    def end(self) -> None:
        """Ends an idle process by asking, any other by force."""
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.kill()
        self._folder.cleanup()

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()
        self._folder.cleanup()

    def _read(self) -> None:
        # Before the worker is there, Blender and what it runs at its start print what they like.
        for line in dropwhile(lambda line: not line.startswith(GREETINGS), self._process.stdout):
            self._messages.put(json.loads(line))
        self._messages.put(None)

    def _heard(self, limits: Limits) -> Iterator[dict | None]:
        """Each message, and None where there was none for INTERVAL s."""
        end = time.monotonic() + limits.timeout if limits.timeout else float("inf")
        while True:
            try:
                message = self._messages.get(timeout=INTERVAL)
            except queue.Empty:
                if time.monotonic() > end:
                    self.kill()
                    raise BlenderLost(f"no end after {limits.timeout:g} s while {self._doing}") from None
                if limits.memory and self._memory() > limits.memory:
                    self.kill()
                    size = f"{limits.memory / 2**20:,.0f} MiB"
                    raise BlenderLost(f"needed more than {size} of memory while {self._doing}") from None
                yield None
                continue
            if message is None:
                raise BlenderLost(self._epitaph())
            if "refused" in message:
                self.end()
                raise SinewError(message["refused"])
            self._doing = message.get("doing", self._doing)
            yield message

    def _epitaph(self) -> str:
        status = self._process.wait()
        self._folder.cleanup()
        try:
            how = signal.Signals(-status).name
        except ValueError:
            how = f"status {status}"
        return f"Blender crashed ({how}) while {self._doing}"

    def _memory(self) -> int:
        import psutil

        try:
            return psutil.Process(self._process.pid).memory_info().rss
        except psutil.Error:
            return 0


def _command() -> list[str]:
    bpy, package = sys.modules.get("bpy"), __package__
    if bpy is None or not bpy.app.binary_path:
        return [sys.executable, "-m", f"{package}.worker"]
    as_here = ["--factory-startup"] if bpy.app.factory_startup else []
    # The user's preferences as saved need not have it on.
    with_sinew = ["--addons", package, "--python-expr", f"from {package}.worker import main; main()"]
    return [bpy.app.binary_path, "--background", *as_here, "--python-exit-code", "1", *with_sinew]
