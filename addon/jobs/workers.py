# SPDX-License-Identifier: GPL-3.0-or-later
"""The workers of a batch: Blenders on this machine.

This process distributes the tasks: the Blenders are separate processes already, and dask would take as much
time for a small file as Blender takes to save it (bench/README.md).
"""

import contextlib
import importlib.metadata
import uuid
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import TypeAlias

import sinew

from ..base.errors import SinewError
from ..blender_process import BlenderLost, BlenderProcess, Limits, wait_for_any
from ..features.pages.opengl import default_engine
from .journal import UNFINISHED, content_hash, stamp

ATTEMPTS = 2


@cache
def versions() -> dict[str, str]:
    """Returns the releases of Sinew and of Blender in this Python, on which results depend."""
    try:
        return {"sinew": sinew.__version__, "blender": importlib.metadata.version("bpy")}
    except importlib.metadata.PackageNotFoundError:
        raise SinewError("this Python has no Blender; install bpy") from None


Steps: TypeAlias = Generator[BlenderProcess, None, dict]
"""Yields the Blender that is at work, for the caller to wait for it, and returns the outcome."""

_engine = cache(default_engine)


class _Blenders:
    """The Blenders of this process, each reused for the next file. Threads of a cluster's worker share
    them."""

    def __init__(self) -> None:
        self._idle: list[BlenderProcess] = []
        self._busy: set[BlenderProcess] = set()

    def run(self, task: dict, limits: Limits) -> Steps:
        blender = self._take(limits)
        try:
            if task.get("pictures") is not None:
                # Found once for all of them, while the first one starts.
                task = {**task, "engine": _engine()}
            blender.send(task, limits)
            while (outcome := blender.poll()) is None:
                yield blender
        finally:
            self._busy.discard(blender)
        if blender.is_spent(limits):
            blender.end()
        else:
            self._idle.append(blender)
        return outcome

    def _take(self, limits: Limits) -> BlenderProcess:
        try:
            blender = self._idle.pop()
        except IndexError:
            blender = BlenderProcess(limits, wait=False)
        self._busy.add(blender)
        return blender

    def end(self) -> None:
        """Ends the idle ones."""
        while self._idle:
            self._idle.pop().end()

    def stop(self) -> None:
        """Ends all of them at once."""
        for blender in list(self._busy):
            blender.end()
        self.end()


_blenders = _Blenders()


def end_blenders() -> None:
    """Ends this process's idle Blenders; a cluster's worker calls it when a batch is over."""
    _blenders.end()


def do_task(task: dict, limits: Limits) -> dict:
    """Returns the outcome of a task from a Blender of this process."""
    return _last(_steps(task, limits))


def _last(steps: Steps) -> dict:
    while True:
        try:
            wait_for_any([next(steps)])
        except StopIteration as end:
            return end.value


def _steps(
    task: dict,
    limits: Limits,
    run: Callable[[dict, Limits], Steps] = _blenders.run,
    versions: Callable[[], dict[str, str]] = versions,
) -> Steps:
    """Does a task. It is tried once more in a new process where Blender crashed or was ended.

    task  "command", "source", "target", what the command needs, and "known": hash and versions of a source
          that need not be processed again, or None
    run   performs the task, in another process or in this one

    A copy, where the task "writes" one, is written in the folder of its target under the name "unfinished";
    the journal's writer renames it.
    """
    source, target = Path(task["source"]), Path(task["target"])
    facts: dict[str, object] = {"versions": versions()}
    if task["known"] is not None and task["known"] == {**facts, "hash": content_hash(source)}:
        return {"unchanged": True}
    for attempt in range(1, ATTEMPTS + 1):
        facts["attempts"] = attempt
        # Short, as the target's name may have the system's maximal length.
        unfinished = target.with_name(f".{uuid.uuid4().hex[:12]}{UNFINISHED}")
        try:
            outcome = yield from run({**task, "unfinished": str(unfinished)}, limits)
        except BlenderLost as lost:
            outcome = {"error": f"{source}: {lost}; tried {attempt} times"}
            for leftover in (unfinished, unfinished.with_name(f"{unfinished.name}@")):
                with contextlib.suppress(OSError):
                    leftover.unlink()
            continue
        except SinewError as error:
            outcome = {"error": str(error)}
        break
    if "error" in outcome or not task["writes"]:
        return {**outcome, **facts}
    return {**outcome, **facts, "unfinished": unfinished.name, "written": stamp(unfinished)}


def run_here(
    tasks: Sequence[dict],
    run: Callable[[dict], dict],
    versions: Callable[[], dict[str, str]],
) -> Generator[tuple[dict, dict], None, None]:
    """Yields each task and its outcome, one after the other in this process."""

    def at_once(task: dict, _limits: Limits) -> Steps:
        return run(task)
        yield

    for task in tasks:
        yield task, _last(_steps(task, Limits(), at_once, versions))


def run_one_by_one(
    tasks: Iterable[dict], limits: Limits, program: Sequence[str] = ()
) -> Generator[dict, None, None]:
    """Yields the outcome of each task, which writes nothing, from a Blender process that is restarted if it
    crashes or is ended. Raises SinewError where none can be started.

    program  as of BlenderProcess
    """
    blender = None
    try:
        for task in tasks:
            blender = blender or BlenderProcess(limits, program=program)
            try:
                yield blender.run(task, limits)
            except BlenderLost as lost:
                blender = None
                yield {"error": f"{lost}"}
    finally:
        if blender is not None:
            blender.end()


class _Running:
    """A task that a Blender does. `blender` is to be waited for; `outcome` is None until it is done."""

    def __init__(self, task: dict, limits: Limits, versions: Callable[[], dict[str, str]]) -> None:
        self.task = task
        self.outcome: dict | None = None
        self._steps = _steps(task, limits, versions=versions)
        self.go_on()

    def go_on(self) -> None:
        if self.outcome is not None:
            return
        try:
            self.blender = next(self._steps)
        except StopIteration as end:
            self.outcome = end.value
        except Exception as error:
            self.outcome = failure(self.task, error)


def run_on_this_machine(
    tasks: Sequence[dict], limits: Limits, jobs: int, versions: Callable[[], dict[str, str]] = versions
) -> Generator[tuple[dict, dict], None, None]:
    """Yields each task and its outcome, in the order in which `jobs` Blenders finish them.

    Raises SinewError where no Blender can be started. Tasks that are not done when the generator is closed or
    interrupted are dropped.
    """
    versions()
    waiting = deque(tasks)
    running: list[_Running] = []
    end = _blenders.stop
    try:
        while waiting or running:
            for each in running:
                each.go_on()
            done = [(each.task, each.outcome) for each in running if each.outcome is not None]
            running = [each for each in running if each.outcome is None]
            # A Blender gets its next file before the outcome of its last one is handled.
            while waiting and len(running) < jobs:
                running.append(_Running(waiting.popleft(), limits, versions))
            yield from done
            busy = [each.blender for each in running if each.outcome is None]
            if len(busy) == len(running):
                wait_for_any(busy)
        end = _blenders.end
    finally:
        end()


def failure(task: dict, error: Exception) -> dict:
    """Returns the outcome of a task that an error ended."""
    return {"error": f"{task['source']}: {sentence(error)}"}


def sentence(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return f"{type(error).__name__}: {lines[0]}" if lines else type(error).__name__
