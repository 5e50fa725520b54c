# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command line says and shows: results on standard output, all else on standard error."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, TextIO, TypeVar

from ..core import interrupt
from ..core.errors import SinewError

if TYPE_CHECKING:
    from rich.console import Console as RichConsole
    from rich.progress import Progress, TaskID

Item = TypeVar("Item")
_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


class Console:
    """Output through `rich` where it is installed, plain where it is not (Blender's own Python)."""

    def __init__(self, out: TextIO, err: TextIO, verbose: bool = False) -> None:
        self.out = out
        self.err = err
        self.verbose = verbose
        self._has_bar = False
        self._close_bar: Callable[[], None] | None = None
        self._rich: RichConsole | None = None
        with suppress(ImportError):
            from rich.console import Console as RichConsole

            self._rich = RichConsole(file=err, highlight=False)

    def say(self, text: str) -> None:
        """A result, on standard output. Raises SinewError where nobody takes it, as on a full disk."""
        with self._given_out():
            print(_shown(text) if self.out.isatty() else text, file=self.out, flush=True)

    def note(self, text: str) -> None:
        """A word about the work, on standard error."""
        if self._has_bar and self._rich is not None:
            # Above the bar, which would otherwise be written into.
            self._rich.print(_shown(text), markup=False, soft_wrap=True)
        else:
            # What nobody hears is no reason to stop.
            with suppress(OSError):
                print(_shown(text), file=self.err, flush=True)

    def complain(self, text: object) -> None:
        """One sentence on what went wrong, on standard error."""
        self.note(f"sinew: {text}")

    def table(self, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        if self._rich is not None:
            import rich.console
            import rich.table
            import rich.text

            # A path is nothing without its end.
            table = rich.table.Table(*(rich.table.Column(name, overflow="fold") for name in columns))
            for row in rows:
                table.add_row(*(rich.text.Text(_shown(cell)) for cell in row))
            # Not cut to 80 columns where there is no terminal to fit.
            width = None if self.out.isatty() else 200
            with self._given_out():
                rich.console.Console(file=self.out, highlight=False, width=width).print(table)
            return
        widths = [max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns))]
        for row in [columns, *rows]:
            self.say("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())

    def progress(self, items: Iterable[Item], total: int, what: str) -> Iterator[Item]:
        """The items, with a bar on a terminal and one line elsewhere."""
        with self.bar(what, total) as show:
            for number, item in enumerate(items):
                yield item
                interrupt.check()
                show((number + 1) / total)

    @contextmanager
    def bar(self, what: str, total: int) -> Iterator[Callable[[float], None]]:
        """Shows how far a work of `total` parts gets on: call what it gives with the share that is done, 0 to
        1. A bar on a terminal, one line elsewhere."""
        if self._rich is None or not self._rich.is_terminal:
            self.note(f"{what} ({total})")
            yield lambda _share: None
            return
        from rich.progress import Progress

        with Progress(console=self._rich) as bar:
            task = bar.add_task(what, total=1.0)
            self._close_bar = bar.stop
            try:
                yield lambda share: bar.update(task, completed=share)
            finally:
                self._close_bar = None

    @contextmanager
    def _given_out(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            # The rest of it would be tried again, with a traceback, at the end of the process.
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.out.fileno())
            raise SinewError(f"standard output: can not be written: {error.strerror or error}") from None

    def close(self) -> None:
        """Gives the terminal back where the process is about to end at once."""
        if self._close_bar is not None:
            self._close_bar()
        self.out.flush()
        self.err.flush()

    @contextmanager
    def batch(self, what: str, total: int) -> Iterator[BatchProgress]:
        """Shows how a batch of `total` files gets on: a bar on a terminal, a line for each file elsewhere."""
        if self._rich is None or not self._rich.is_terminal:
            yield BatchProgress(self, total)
            return
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("{task.description}"),
            # Room for a terminal's ^C in 80 columns: where that wraps, the bar is drawn twice.
            BarColumn(bar_width=20),
            MofNCompleteColumn(),
            TextColumn("{task.fields[meshes]} meshes, {task.fields[failed]} failed"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=self._rich) as bar:
            self._has_bar = True
            try:
                yield BatchProgress(self, total, bar, bar.add_task(what, total=total, meshes=0, failed=0))
            finally:
                self._has_bar = False


def _shown(text: str) -> str:
    """Without what would steer a terminal: names in files can hold anything."""
    return _CONTROLS.sub("\N{REPLACEMENT CHARACTER}", text)


class BatchProgress:
    """Counts of a batch at work."""

    def __init__(
        self,
        console: Console,
        total: int,
        bar: Progress | None = None,
        bar_task: TaskID | None = None,
    ) -> None:
        self.done = self.meshes = self.failed = 0
        self._console, self._total, self._bar, self._bar_task = console, total, bar, bar_task

    def step(self, line: str | None, meshes: int, failed: bool) -> None:
        """One more file: what to say of it, if that is not said."""
        self.done += 1
        self.meshes += meshes
        self.failed += failed
        if self._bar is not None and self._bar_task is not None:
            self._bar.update(self._bar_task, completed=self.done, meshes=self.meshes, failed=self.failed)
        elif line is not None:
            self._console.note(f"[{self.done}/{self._total}] {line}")


def take_over_output() -> Console:
    """Keeps standard output and error for Sinew alone: what Blender prints goes nowhere.

    Blender writes to the file descriptors themselves, so they are pointed elsewhere for good; it still
    prints at the end of the process.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    out = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="replace")
    err = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="replace")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    os.close(nowhere)
    # A traceback of ours is a bug and must be seen.
    sys.stderr = err
    return Console(out, err)


def keep_output() -> Console:
    """Leaves Blender's output where it was, for `--verbose`."""
    return Console(sys.stdout, sys.stderr, verbose=True)
