# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes whole files, so that readers never find a half-written one. Failures are reported in one
sentence."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import SinewError, WrongUse


def remove(path: Path) -> None:
    """Removes a file if it exists and can be removed; on a read-only disk even the attempt raises OSError."""
    with suppress(OSError):
        path.unlink(missing_ok=True)


def sentence(error: OSError) -> str:
    """Returns the message of a system error, with the file that it is about."""
    what = error.strerror or str(error) or type(error).__name__
    return f"{error.filename}: {what}" if error.filename is not None else what


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Context that turns an OSError into the SinewError that `path` cannot be written."""
    try:
        yield
    except OSError as error:
        raise SinewError(f"{path}: can not be written: {error.strerror or error}") from None


def folder_to_write(given: str | Path) -> Path:
    """The type of an argument that names a folder to write to.

    Raises SinewError where files cannot be written to it, or where it does not exist and cannot be made: so
    the error comes before a long computation.
    """
    folder = Path(given)
    nearest = next(path for path in (folder, *folder.absolute().parents) if os.path.lexists(path))
    if not nearest.is_dir():
        what = "a file" if nearest.exists() else "a link to nothing"
        raise SinewError(f"{folder}: can not be written: {nearest} is {what}")
    try:
        # Permissions are not reliable: root has all of them, even on a read-only disk and in /proc.
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise SinewError(
            f"{folder}: can not be written: nothing can be made in {nearest}: {error.strerror or error}"
        ) from None
    return folder


def file_to_write(given: str | Path, endings: tuple[str, ...]) -> Path:
    """The type of an argument that names a file to write or to replace. Raises as folder_to_write() does, and
    WrongUse where its name has none of the `endings`: a mistyped argument must not replace another file."""
    path = Path(given)
    if path.suffix.lower() not in endings:
        raise WrongUse(f"{path}: expected a name ending in {', '.join(endings)}")
    folder_to_write(path.parent)
    if path.is_dir():
        raise SinewError(f"{path}: can not be written: it is a folder, expected a file")
    if path.exists() and not path.is_file():
        raise SinewError(f"{path}: can not be written: it is a device or a pipe, expected a file")
    return path


def unfinished_path(path: Path) -> Path:
    """A temporary path in the folder of `path`, with its suffix, by which some writers choose the format."""
    return path.with_name(f".{path.stem}.unfinished{path.suffix}")


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Calls `write` with unfinished_path(), then renames the file; makes missing folders.

    Raises SinewError where it cannot be written. After any exception the temporary file is removed.
    """
    unfinished = unfinished_path(path)
    made = [folder for folder in path.parents if not folder.exists()]
    # Otherwise a symbolic link of that name, in a folder made by somebody else, would be followed.
    remove(unfinished)
    try:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            write(unfinished)
            unfinished.replace(path)
    except BaseException:
        remove(unfinished)
        for folder in made:
            with suppress(OSError):  # it is no longer empty
                folder.rmdir()
        raise


def write_text(path: Path, text: str) -> None:
    """Writes UTF-8. File names on a disk need not be valid text: invalid bytes become "?"."""
    write_whole(path, lambda unfinished: unfinished.write_bytes(text.encode("utf-8", errors="replace")))
