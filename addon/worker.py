# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender behind blender_process.py: tasks come in as lines of JSON, outcomes go out."""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .blender_process import DOING, PROCESSORS
from .core.errors import SinewError
from .jobs.journal import content_hash

Report = Callable[..., None]
"""Told what is being done to the file, such as "opening it", and by keyword what else there is to know."""


def run(task: dict, report: Report) -> dict:
    """Does one task in this process: what became of it, and the hash of what was read."""
    from .features.bake import bake_apart
    from .jobs.tasks import preflight, reskin

    actions = {
        "reskin": reskin.reskin,
        "restore": reskin.restore,
        "export": bake_apart.export,
        "check": preflight.check,
    }
    try:
        # First: what is written to the file afterwards is then known to have changed it.
        read = {"hash": content_hash(Path(task["source"]))}
        return actions[task["command"]](task, report) | read
    except SinewError as error:
        return {"error": str(error)}
    except Exception as error:
        traceback.print_exc()
        return {"error": f"{task['source']}: {type(error).__name__}: {error}"}


def main() -> None:
    # Blender prints to standard output whenever it likes, and what it runs may read standard input.
    tasks, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    os.dup2(2, 1)

    def answer(message: dict) -> None:
        answers.write(json.dumps(message).encode() + b"\n")

    _end_with_parent()
    try:
        from .prepare import prepare_blender

        with _only_on({int(number) for number in os.environ.get(PROCESSORS, "").split()}):
            prepare_blender()
    except SinewError as error:
        answer({"refused": str(error)})
        return
    answer({"ready": True})
    with Path(tempfile.gettempdir(), DOING).open("wb", buffering=0) as doing:

        def report(what: str, **more: object) -> None:
            with suppress(OSError):  # as where the disk is full
                doing.seek(0)
                # At once, for it is read at any moment; blanks over what was there.
                doing.write(json.dumps({"doing": what, **more}).ljust(120).encode())

        for line in tasks:
            report("starting on it")
            answer(run(json.loads(line), report))


@contextmanager
def _only_on(processors: Collection[int]) -> Iterator[None]:
    """A context in which this process has only those processors, if any are named: Blender makes threads for
    those that it finds when it starts, and keeps to as many."""
    if not processors:
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, processors)
    try:
        yield
    finally:
        for thread in os.listdir("/proc/self/task"):
            with suppress(ProcessLookupError):  # it has ended
                os.sched_setaffinity(int(thread), before)


def _end_with_parent() -> None:
    """A Blender that hangs would outlive a batch that was killed: where the system can, it goes along."""
    if sys.platform == "linux":
        import ctypes

        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)


if __name__ == "__main__":
    main()
