# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command line says and shows: results on standard output, all else on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import TextIO, TypeVar

Item = TypeVar("Item")


class Console:
    """Output through `rich` where it is installed, plain where it is not (Blender's own Python)."""

    def __init__(self, out: TextIO, err: TextIO) -> None:
        self.out = out
        self.err = err
        try:
            import rich.console
        except ImportError:
            self._rich = None
        else:
            self._rich = rich.console.Console(file=err, highlight=False)

    def say(self, text: str) -> None:
        """A result, on standard output."""
        print(text, file=self.out, flush=True)

    def note(self, text: str) -> None:
        """A word about the work, on standard error."""
        print(text, file=self.err, flush=True)

    def complain(self, text: object) -> None:
        """One sentence on what went wrong, on standard error."""
        self.note(f"sinew: {text}")

    def table(self, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        if self._rich is not None:
            import rich.console
            import rich.table
            import rich.text

            table = rich.table.Table(*columns)
            for row in rows:
                table.add_row(*(rich.text.Text(cell) for cell in row))
            # Not cut to 80 columns where there is no terminal to fit.
            width = None if self.out.isatty() else 200
            rich.console.Console(file=self.out, highlight=False, width=width).print(table)
            return
        widths = [max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns))]
        for row in [columns, *rows]:
            self.say("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())

    def progress(self, items: Iterable[Item], total: int, what: str) -> Iterator[Item]:
        """The items, with a bar on a terminal and one line elsewhere."""
        if self._rich is not None and self._rich.is_terminal:
            import rich.progress

            yield from rich.progress.track(items, description=what, total=total, console=self._rich)
            return
        self.note(f"{what} ({total})")
        yield from items


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
    return Console(sys.stdout, sys.stderr)
