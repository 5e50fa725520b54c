# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender behind blender_process.py: tasks come in as lines of JSON, outcomes go out."""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from collections.abc import Callable

from .core.errors import SinewError

Report = Callable[..., None]
"""Told what is being done to the file, such as "opening it", and by keyword what else there is to know."""


def run(task: dict, report: Report) -> dict:
    """Does one task in this process: what became of it."""
    from .blender import bake_apart, reskin

    actions = {"reskin": reskin.reskin, "restore": reskin.restore, "export": bake_apart.export}
    try:
        return actions[task["command"]](task, report)
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

        prepare_blender()
    except SinewError as error:
        answer({"refused": str(error)})
        return
    answer({"ready": True})
    for line in tasks:
        answer(run(json.loads(line), lambda doing, **more: answer({"doing": doing, **more})))


def _end_with_parent() -> None:
    """A Blender that hangs would outlive a batch that was killed: where the system can, it goes along."""
    if sys.platform == "linux":
        import ctypes

        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)


if __name__ == "__main__":
    main()
