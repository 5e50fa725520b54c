# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes files so that a reader never finds half of one."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from .errors import SinewError


def remove(path: Path) -> None:
    """Takes away what is not wanted, if it is there and can be: on a read-only disk even asking fails."""
    with suppress(OSError):
        path.unlink(missing_ok=True)


def check_folder(folder: Path) -> None:
    """Raises SinewError where files can not be written to a folder that is there or is to be made: known
    before what takes long."""
    nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not nearest.is_dir():
        raise SinewError(f"{folder}: can not be written: {nearest} is a file")
    if not os.access(nearest, os.W_OK):
        raise SinewError(f"{folder}: can not be written: no permission to write to {nearest}")


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Has `write` make a file beside `path`, then renames it; its folder is made where it is missing.

    Raises SinewError where it can not be written.
    """
    # The ending stays: some writers go by it.
    unfinished = path.with_name(f".{path.stem}.unfinished{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(unfinished)
        unfinished.replace(path)
    except OSError as error:
        remove(unfinished)
        raise SinewError(f"{path}: can not be written: {error.strerror or error}") from None


def write_text(path: Path, text: str) -> None:
    write_whole(path, lambda unfinished: unfinished.write_text(text, encoding="utf-8", newline="\n"))
