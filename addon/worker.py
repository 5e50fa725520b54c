# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs in the Blender of blender_process.py: reads tasks as lines of JSON, writes outcomes."""

import json
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType

from .base.errors import SinewError
from .blender_process import DOING, PROCESSORS
from .jobs.journal import content_hash

Report = Callable[..., None]
"""Called with what is being done to the file, such as "opening it", and with details by keyword."""
Action = Callable[[dict, Report], dict]
"""Performs a task, and returns its outcome."""


def run(task: dict, report: Report, others: Mapping[str, Action] = MappingProxyType({})) -> dict:
    """Performs one task in this process; returns its outcome with the hash of the file that was read."""
    from .features.bake import bake_apart
    from .features.gltf import export_file
    from .jobs.tasks import flex, preflight, reskin

    actions: dict[str, Action] = {
        "reskin": reskin.reskin,
        "restore": reskin.restore,
        "export": bake_apart.export,
        "write": export_file.write_apart,
        "check": preflight.check,
        "flex": flex.flex,
        **others,
    }
    try:
        # Hashed first, so that a later change of the file is noticed.
        read = {"hash": content_hash(Path(task["source"]))}
        return actions[task["command"]](task, report) | read
    except SinewError as error:
        return {"error": str(error)}
    except Exception as error:
        traceback.print_exc()
        return {"error": f"{task['source']}: {type(error).__name__}: {error}"}


def main(others: Mapping[str, Action] = MappingProxyType({})) -> None:
    """others: what it can do beside Sinew's own tasks, by the command of a task."""
    # Blender may print to standard output at any time, and scripts may read standard input: both are
    # replaced.
    tasks, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    os.dup2(2, 1)

    def reply(message: dict) -> None:
        replies.write(json.dumps(message).encode() + b"\n")

    _end_with_parent()
    try:
        from .prepare import prepare_blender

        with _only_on({int(number) for number in os.environ.get(PROCESSORS, "").split()}):
            prepare_blender()
    except SinewError as error:
        reply({"refused": str(error)})
        return
    reply({"ready": True})
    with Path(tempfile.gettempdir(), DOING).open("wb", buffering=0) as doing:

        def report(what: str, **more: object) -> None:
            with suppress(OSError):  # a full disk, for example
                doing.seek(0)
                # In one write, because it can be read at any moment; blanks cover the last report.
                doing.write(json.dumps({"doing": what, **more}).ljust(120).encode())

        for line in tasks:
            report("starting on it")
            reply(run(json.loads(line), report, others))


@contextmanager
def _only_on(processors: Collection[int]) -> Iterator[None]:
    """Context in which this process may use only those processors, if any are given: Blender makes a thread
    for each processor that it finds when it starts."""
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
    """Has the system end this process with its parent, where it can: otherwise a Blender that hangs would
    outlive a killed batch."""
    if sys.platform == "linux":
        import ctypes

        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)


if __name__ == "__main__":
    main()
