# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender in a separate process that performs one task after the other, supervised by this process.

Starting Blender takes 0.5 to 2 s, opening a file 10 ms and more: so a process is reused for the next file,
which replaces the last one. A process that crashes, hangs or grows too large is ended, and the next file gets
a new one.
"""

import contextlib
import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from .base import pipes
from .base.errors import SinewError
from .base.scratch import ScratchFolder
from .base.windows_job import end_all_with_this_process, end_with_this_process

# The name of the file in which a Blender reports what it is doing: a JSON object, padded with blanks.
DOING = "doing"
# Environment variable: the numbers of the processors to start on, if it is set.
PROCESSORS = "SINEW_PROCESSORS"
START_LIMIT = 180.0
# The equivalent of start_new_session, which Windows ignores.
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
# Seconds between two checks of a busy process.
INTERVAL = 0.1
# The first message of worker.py.
GREETINGS = (b'{"ready"', b'{"refused"')


# What Windows, and so Blender's own message, calls the commonest. Blender's handler of crashes ends with 11.
CRASHES = {
    11: "EXCEPTION_ACCESS_VIOLATION",
    0xC0000005: "EXCEPTION_ACCESS_VIOLATION",
    0xC00000FD: "EXCEPTION_STACK_OVERFLOW",
}


class BlenderLost(Exception):  # noqa: N818
    """The process ended, or had to be ended, before the file was done. The message is the end of a
    sentence."""


@dataclass(frozen=True)
class Limits:
    """Limits for one file.

    timeout  seconds; 0: no limit
    memory   bytes; 0: no limit
    threads  of Blender, where the system can set them; 0: one for each processor
    verbose  show what Blender prints
    """

    timeout: float = 0.0
    memory: int = 0
    threads: int = 0
    verbose: bool = False


class BlenderProcess:
    """One Blender: bpy in this Python, or the Blender program that runs this code. While it is at work, the
    caller has to call poll(), which also ends it where it exceeds a limit.

    wait     waits until it has started, and raises SinewError where it cannot be started; otherwise poll()
             does so
    program  the words that start it, where it has other tasks than those of worker.py
    """

    def __init__(self, limits: Limits, wait: bool = True, program: Sequence[str] = ()) -> None:
        # Blender's own temporary folder is inside: it remains when Blender is killed.
        self._folder = ScratchFolder()
        own = str(self._folder.path)
        if not _has_window():
            end_all_with_this_process()
        try:
            self._process = subprocess.Popen(
                program or _command(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=None if limits.verbose else subprocess.DEVNULL,
                env={**_environment(limits), "TMPDIR": own, "TEMP": own},
                # Ctrl-C in a terminal is for the batch, which ends its Blenders itself.
                start_new_session=True,
                creationflags=NEW_GROUP,
            )
        except OSError as error:
            self._folder.remove()
            raise SinewError(f"no Blender can be started: {error.strerror or error}") from None
        end_with_this_process(self._process)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._tasks, self._replies = self._process.stdin, self._process.stdout
        self._received = b""
        self._has_started = False
        # What it gets to do once it has started.
        self._next: tuple[dict, Limits] | None = None
        self._excess: str | None = None
        # Bytes of memory at the last check.
        self._size = 0
        self._checked = 0.0
        self._begin(Limits(START_LIMIT))
        if wait:
            while not self._has_started:
                self.poll()
                wait_for_any([self])

    def run(self, task: dict, limits: Limits) -> dict:
        """Returns the outcome of the task. Raises BlenderLost; the process cannot be used any more then."""
        self.send(task, limits)
        while (outcome := self.poll()) is None:
            wait_for_any([self])
        return outcome

    def follow(self, task: dict, limits: Limits) -> Iterator[dict]:
        """Yields its reports on the task, every INTERVAL s, and finally the outcome. Raises as run() does;
        closing the iterator before the outcome ends the process."""
        outcome = None
        try:
            self.send(task, limits)
            while (outcome := self.poll()) is None:
                yield self._progress_report()
                wait_for_any([self])
        finally:
            if outcome is None:
                self.end()
        yield outcome

    def send(self, task: dict, limits: Limits) -> None:
        """Gives it a task; poll() will return the outcome. Raises BlenderLost."""
        if not self._has_started:
            self._next = task, limits
            return
        self._begin(limits)
        try:
            self._tasks.write(json.dumps(task).encode() + b"\n")
            self._tasks.flush()
        except OSError:
            raise BlenderLost(self._cause_of_end()) from None

    def poll(self) -> dict | None:
        """Returns the outcome of the task, or None while it is at work. Raises BlenderLost, and SinewError
        where it cannot be started; the process cannot be used any more then."""
        has_ended = False
        while not has_ended and pipes.can_read(self.replies):
            received = os.read(self.replies, 2**16)
            self._received += received
            has_ended = not received
        # A file that is done in time is kept.
        while b"\n" in self._received:
            line, _end, self._received = self._received.partition(b"\n")
            if self._has_started:
                return json.loads(line)
            # Before the worker starts, Blender and its startup scripts can print anything.
            if line.startswith(GREETINGS):
                self._start(json.loads(line))
        if has_ended:
            raise BlenderLost(self._cause_of_end())
        if time.monotonic() >= self._checked + INTERVAL:
            self._check_limits()
        return None

    def _start(self, greeting: dict) -> None:
        if "refused" in greeting:
            self.end()
            raise SinewError(greeting["refused"])
        self._has_started = True
        self._begin(Limits())
        if self._next is not None:
            self.send(*self._next)

    @property
    def replies(self) -> int:
        """The file descriptor that can be read when poll() has something."""
        return self._replies.fileno()

    def is_spent(self, limits: Limits) -> bool:
        """Whether the next file should get a new process, as memory that Blender does not free
        accumulates."""
        return self._excess is not None or 0 < limits.memory / 2 < self._size

    def end(self) -> None:
        """Kills the process: it has no unsaved work, and would take 0.2 s to end by itself."""
        self._process.kill()
        self._clean_up()

    def _begin(self, limits: Limits) -> None:
        self._limits, self._since = limits, time.monotonic()

    def _check_limits(self) -> None:
        self._checked = time.monotonic()
        self._excess = self._found_excess(self._limits)
        if self._excess is not None:
            self._process.kill()
            raise BlenderLost(self._cause_of_end())

    def _found_excess(self, limits: Limits) -> str | None:
        if limits.timeout and time.monotonic() > self._since + limits.timeout:
            return f"no end after {limits.timeout:g} s while {self._doing()}"
        if limits.memory:
            self._size = self._memory()
        if 0 < limits.memory < self._size:
            return f"needed more than {limits.memory / 2**20:,.0f} MiB of memory while {self._doing()}"
        return None

    def _cause_of_end(self) -> str:
        how = how_it_ended(self._process.wait())
        doing = self._doing()
        self._clean_up()
        return self._excess or f"{how} while {doing}"

    def _clean_up(self) -> None:
        self._process.wait()
        self._folder.remove()

    def _doing(self) -> str:
        return self._progress_report().get("doing", "starting")

    def _progress_report(self) -> dict:
        """Returns what it is doing, as "doing", and its progress; empty before its first report."""
        with contextlib.suppress(OSError, ValueError):
            return json.loads((self._folder.path / DOING).read_bytes())
        return {}

    def _memory(self) -> int:
        import psutil

        try:
            return psutil.Process(self._process.pid).memory_info().rss
        except psutil.Error:
            return 0


def how_it_ended(status: int, is_windows: bool = os.name == "nt") -> str:
    """Returns the beginning of a sentence.

    status  of a process: elsewhere than on Windows, that of a crash is -1 times the signal
    """
    if status < 0:
        return f"Blender crashed ({signal.Signals(-status).name})"
    if is_windows and status in CRASHES:
        return f"Blender crashed ({CRASHES[status]})"
    if is_windows and status >= 0x80000000:
        return f"Blender crashed (exception 0x{status:08X})"
    return f"Blender was ended (status {status})"


def wait_for_any(blenders: Iterable[BlenderProcess]) -> None:
    """Returns when one of them may have something for poll(), and after INTERVAL s at the latest."""
    pipes.wait_for_any([blender.replies for blender in blenders], INTERVAL)


_started = itertools.count()


def _has_window() -> bool:
    bpy = sys.modules.get("bpy")
    return bpy is not None and not bpy.app.background


def _command() -> list[str]:
    bpy, package = sys.modules.get("bpy"), __package__
    if bpy is None or not bpy.app.binary_path:
        return [sys.executable, "-m", f"{package}.worker"]
    factory = ["--factory-startup"] if bpy.app.factory_startup else []
    # The extension need not be enabled in the saved preferences.
    with_sinew = ["--addons", package, "--python-expr", f"from {package}.worker import main; main()"]
    return [bpy.app.binary_path, "--background", *factory, "--python-exit-code", "1", *with_sinew]


def _environment(limits: Limits) -> dict[str, str]:
    """Returns the environment of this process, with the number of threads of `limits`."""
    if not limits.threads:
        return dict(os.environ)
    # Mesa's software OpenGL has threads, too: 0 of them are faster than 1.
    drawing = {"LP_NUM_THREADS": str(limits.threads if limits.threads > 1 else 0)}
    return {**drawing, **os.environ, PROCESSORS: " ".join(map(str, _first_processors(limits)))}


def _first_processors(limits: Limits) -> list[int]:
    """Returns the processors to start a Blender on, different ones for each, as it makes a thread for each of
    them."""
    if not hasattr(os, "sched_getaffinity"):
        return []
    processors = sorted(os.sched_getaffinity(0))
    first = limits.threads * next(_started)
    count = len(processors)
    return [processors[(first + index) % count] for index in range(min(limits.threads, count))]
