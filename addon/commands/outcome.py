# SPDX-License-Identifier: GPL-3.0-or-later
"""The outcome of a command for one file."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..jobs.inputs import Job
from .console import Console


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
