# SPDX-License-Identifier: GPL-3.0-or-later
"""Output of the command line: results on standard output, everything else on standard error."""

from __future__ import annotations

import io
import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

from ..base import interrupt
from ..base.errors import SinewError

if TYPE_CHECKING:
    from rich.console import Console as RichConsole

Item = TypeVar("Item")
_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


class Console:
    """Output through `rich` where it is installed, plain where it is not (Blender's own Python)."""

    def __init__(self, out: TextIO, err: TextIO, verbose: bool = False) -> None:
        self.out = out
        self.err = err
        self.verbose = verbose
        self._has_bar = False
        self._rich: RichConsole | None = None
        with suppress(ImportError):
            from rich.console import Console as RichConsole

            self._rich = RichConsole(file=err, highlight=False)

    def say(self, text: str) -> None:
        """Prints a result on standard output. Raises SinewError where it cannot be written, as on a full
        disk."""
        with self._writing_results():
            print(_shown(text) if self.out.isatty() else text, file=self.out, flush=True)

    def say_json(self, value: object) -> None:
        self.say(json.dumps(value, indent=2, ensure_ascii=False))

    def note(self, text: str) -> None:
        """Prints a note about the work on standard error."""
        if self._has_bar and self._rich is not None:
            # rich prints it above the bar.
            self._rich.print(_shown(text), markup=False, soft_wrap=True)
        else:
            # A note that cannot be printed is no reason to stop.
            with suppress(OSError):
                print(_shown(text), file=self.err, flush=True)

    def note_on(self, path: Path, sentences: Iterable[str]) -> None:
        """Prints what a user should know about a file."""
        for sentence in sentences:
            self.note(f"{path}: {sentence}")

    def complain(self, text: object) -> None:
        """Prints one sentence about a failure on standard error."""
        self.note(f"sinew: {text}")

    def table(self, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        if self._rich is not None:
            import rich.console
            import rich.table
            import rich.text

            # Wrapped, not truncated: the end of a path matters.
            table = rich.table.Table(*(rich.table.Column(name, overflow="fold") for name in columns))
            for row in rows:
                table.add_row(*(rich.text.Text(_shown(cell)) for cell in row))
            # Without a terminal, not truncated to 80 columns.
            width = None if self.out.isatty() else 200
            with self._writing_results():
                rich.console.Console(file=self.out, highlight=False, width=width).print(table)
            return
        widths = [max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns))]
        for row in [columns, *rows]:
            self.say("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())

    def progress(self, items: Iterable[Item], total: int, what: str) -> Iterator[Item]:
        """Yields the items, with a progress bar on a terminal and one line elsewhere."""
        with self.bar(what, total) as show:
            for number, item in enumerate(items):
                yield item
                interrupt.check()
                show((number + 1) / total)

    @contextmanager
    def bar(self, what: str, total: int) -> Iterator[Callable[[float], None]]:
        """Shows the progress of a work of `total` parts: a bar on a terminal, one line elsewhere. The
        returned function is called with the progress, 0 to 1."""
        with self._live(what, tuple, total=1.0) as update:
            if update is None:
                self.note(f"{what} ({total})")
                yield lambda _share: None
            else:
                yield lambda share: update(completed=share)

    @contextmanager
    def _writing_results(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            # Otherwise Python would try to write the rest at the end of the process, with a traceback.
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.out.fileno())
            raise SinewError(f"standard output: can not be written: {error.strerror or error}") from None

    @contextmanager
    def batch(self, what: str, total: int, counted: str) -> Iterator[BatchProgress]:
        """Shows the progress of a batch of `total` files: a bar on a terminal, a line for each file
        elsewhere.

        counted  what is counted beside files, such as "meshes"
        """
        with self._live(what, partial(_columns_of_batch, counted), total=total, number=0, failed=0) as update:
            yield BatchProgress(self, total, update)

    @contextmanager
    def _live(
        self, what: str, columns: Callable[[], tuple], **task: Any
    ) -> Iterator[Callable[..., None] | None]:
        """Context with a function that updates a bar; None where there is no terminal, or no `rich`."""
        if self._rich is None or not self._rich.is_terminal:
            yield None
            return
        from rich.progress import Progress

        with Progress(*columns(), console=self._rich) as bar:
            self._has_bar = True
            try:
                yield partial(bar.update, bar.add_task(what, **task))
            finally:
                self._has_bar = False


def _columns_of_batch(counted: str) -> tuple:
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn

    return (
        TextColumn("{task.description}"),
        # Leaves space for a terminal's ^C in 80 columns: if that wraps, the bar is drawn twice.
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn(f"{{task.fields[number]}} {counted}, {{task.fields[failed]}} failed"),
        TimeRemainingColumn(),
    )


def _shown(text: str) -> str:
    """Returns the text without control characters, which would affect a terminal: names in files can contain
    any."""
    return _CONTROLS.sub("\N{REPLACEMENT CHARACTER}", text)


class BatchProgress:
    """Counts of a running batch."""

    def __init__(self, console: Console, total: int, update: Callable[..., None] | None = None) -> None:
        self.done = self.number = self.failed = 0
        self._console, self._total, self._update = console, total, update

    def show_share(self, share: float) -> None:
        """Shows how far the file is that is at work, 0 to 1."""
        if self._update is not None:
            self._update(completed=self.done + share)

    def step(self, line: str | None, number: int, failed: bool) -> None:
        """Counts one more file, with `number` of what is counted; `line` describes it, None if it was printed
        already."""
        self.done += 1
        self.number += number
        self.failed += failed
        if self._update is not None:
            self._update(completed=self.done, number=self.number, failed=self.failed)
        elif line is not None:
            self._console.note(f"[{self.done}/{self._total}] {line}")


@contextmanager
def discarded_output() -> Iterator[None]:
    """Context in which nothing comes to standard output."""
    sys.stdout.flush()
    out, discard = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(discard, 1)
    os.close(discard)
    try:
        yield
    finally:
        os.dup2(out, 1)
        os.close(out)


def take_over_output() -> Console:
    """Reserves standard output and error for Sinew: what Blender prints is discarded.

    Blender writes to the file descriptors themselves, so these are redirected until the end of the process,
    when it still prints.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    out = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="replace")
    err = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="replace")
    discard = os.open(os.devnull, os.O_WRONLY)
    os.dup2(discard, 1)
    os.dup2(discard, 2)
    os.close(discard)
    # A traceback of Sinew's is a bug and has to be shown.
    sys.stderr = err
    return Console(out, err)


def keep_output() -> Console:
    """Shares standard output and error with Blender, for `--verbose`."""
    for stream in (sys.stdout, sys.stderr):
        # Without UTF-8, as in many of Windows' consoles, characters that cannot be printed are replaced.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    return Console(sys.stdout, sys.stderr, verbose=True)
