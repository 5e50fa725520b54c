# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes files so that a reader never finds half of one; where that can not be, says so in one sentence."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import SinewError, WrongUse


def remove(path: Path) -> None:
    """Takes away what is not wanted, if it is there and can be: on a read-only disk even asking fails."""
    with suppress(OSError):
        path.unlink(missing_ok=True)


def sentence(error: OSError) -> str:
    """What an error of the system says, with the file that it names."""
    what = error.strerror or str(error) or type(error).__name__
    return f"{error.filename}: {what}" if error.filename is not None else what


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """A context in which an OSError becomes the SinewError that `path` can not be written."""
    try:
        yield
    except OSError as error:
        raise SinewError(f"{path}: can not be written: {error.strerror or error}") from None


def folder_to_write(given: str | Path) -> Path:
    """The type of an argument that names a folder to write to.

    Raises SinewError where files can not be written to it, be it there or to be made: known before what takes
    long.
    """
    folder = Path(given)
    nearest = next(place for place in (folder, *folder.absolute().parents) if os.path.lexists(place))
    if not nearest.is_dir():
        what = "a file" if nearest.exists() else "a link to nothing"
        raise SinewError(f"{folder}: can not be written: {nearest} is {what}")
    try:
        # Tried, for root has every permission, on a read-only disk and in /proc as well.
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise SinewError(
            f"{folder}: can not be written: nothing can be made in {nearest}: {error.strerror or error}"
        ) from None
    return folder


def file_to_write(given: str | Path, endings: tuple[str, ...]) -> Path:
    """The type of an argument that names a file to write, or to replace. Raises as folder_to_write(), and
    WrongUse where its name has none of the `endings`: a slip of the hand would replace something else."""
    path = Path(given)
    if path.suffix.lower() not in endings:
        raise WrongUse(f"{path}: expected a name ending in {', '.join(endings)}")
    folder_to_write(path.parent)
    if path.is_dir():
        raise SinewError(f"{path}: can not be written: it is a folder, expected a file")
    if path.exists() and not path.is_file():
        raise SinewError(f"{path}: can not be written: it is a device or a pipe, expected a file")
    return path


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Has `write` make a file beside `path`, then renames it; its folder is made where it is missing.

    Raises SinewError where it can not be written. Whatever is raised, nothing half-written is left.
    """
    # The ending stays: some writers go by it.
    unfinished = path.with_name(f".{path.stem}.unfinished{path.suffix}")
    made = [folder for folder in path.parents if not folder.exists()]
    # A link of that name, in a folder from elsewhere, would be written through.
    remove(unfinished)
    try:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            write(unfinished)
            unfinished.replace(path)
    except BaseException:
        remove(unfinished)
        for folder in made:
            with suppress(OSError):  # it has something in it by now
                folder.rmdir()
        raise


def write_text(path: Path, text: str) -> None:
    """As UTF-8. Names on a disk need not be text: what is not is shown with a ?."""
    write_whole(path, lambda unfinished: unfinished.write_bytes(text.encode("utf-8", errors="replace")))
