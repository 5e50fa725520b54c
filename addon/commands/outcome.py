# SPDX-License-Identifier: GPL-3.0-or-later
"""What a command does to each of several files, each with an outcome of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from ..base.errors import SinewError
from ..jobs.inputs import Job
from .console import Console

if TYPE_CHECKING:
    import bpy


@dataclass
class Outcome:
    """The outcome of a command for one file.

    left_out  a sentence for each object that was not changed
    error     why nothing was written
    notes     what else a user should know
    """

    job: Job
    left_out: list[str] = field(default_factory=list)
    error: str | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def failed(self) -> bool:
        return self.error is not None or bool(self.left_out)

    @property
    def result(self) -> str:
        """For a table's last column."""
        if self.error is not None:
            return "failed"
        if self.left_out:
            return f"{self.job.target}, {len(self.left_out)} left as they were"
        return str(self.job.target)

    def complain(self, console: Console) -> None:
        if self.error is not None:
            console.complain(self.error)
        for reason in self.left_out:
            console.complain(f"{self.job.source}: left as it was: {reason}")
        console.note_on(self.job.source, self.notes)


Own = TypeVar("Own", bound=Outcome)


def of_each(
    jobs: Iterable[Job],
    kind: Callable[[Job], Own],
    work: Callable[[Own], None],
    overwrite: bool,
    console: Console,
) -> list[Own]:
    """Opens the file of each job, and has `work` write its copy. An error is that of its file alone."""
    from ..io import files

    outcomes = []
    for job in jobs:
        outcome = kind(job)
        try:
            if job.target.exists() and not overwrite:
                raise SinewError(f"{job.target}: is there already; use --overwrite to replace it")
            outcome.notes += files.open_file(job.source)
            work(outcome)
        except SinewError as error:
            outcome.error = str(error)
        outcome.complain(console)
        outcomes.append(outcome)
    return outcomes


def use_method(meshes: Sequence[bpy.types.Object], method: str) -> tuple[list[bpy.types.Object], list[str]]:
    """Has meshes deformed by a method. Returns those that are, and a sentence for each other."""
    from ..deform import characters

    errors = characters.use_methods([(obj, method) for obj in meshes])
    taken = [obj for obj, error in zip(meshes, errors, strict=True) if error is None]
    return taken, [str(error) for error in errors if error is not None]


def conclude(
    console: Console,
    outcomes: Sequence[Own],
    columns: Sequence[str],
    cells: Callable[[Own], Sequence[str]],
    done: str,
) -> int:
    """Prints a row for each file, and how many were done; returns the exit status."""
    console.table(
        ("file", *columns, "result"), [(str(each.job.source), *cells(each), each.result) for each in outcomes]
    )
    good = sum(not outcome.failed for outcome in outcomes)
    console.say(f"{good} of {len(outcomes)} files {done}")
    return 0 if good == len(outcomes) else 1
