# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders for a while, in the system's temporary folder.

A run that is killed leaves its own behind; the next one takes it away. A lock tells whether a run is alive:
it holds across containers that share the temporary folder, where the number of a process does not.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from .lock import try_lock

PREFIX = "sinew-"
LOCK = ".lock"


class ScratchFolder:
    """A folder that is there until remove(), or until a later run finds its process ended.

    Raises OSError where none can be made.
    """

    def __init__(self) -> None:
        _clear_away()
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        # Windows does not rename what is open; elsewhere nobody finds the lock before it is one.
        name = self.path / (LOCK if os.name == "nt" else f"{LOCK}.new")
        try:
            self._lock = name.open("wb")
        except OSError:
            self.path.rmdir()
            raise
        try_lock(self._lock.fileno())
        if name.name != LOCK:
            name.rename(self.path / LOCK)

    def remove(self) -> None:
        """All that can be removed: Windows keeps what some process has open."""
        self._lock.close()
        shutil.rmtree(self.path, ignore_errors=True)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    folder = ScratchFolder()
    try:
        yield folder.path
    finally:
        folder.remove()


@cache
def _clear_away() -> None:
    """Removes what dead runs of this user left; once in a process."""
    with suppress(OSError):
        for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
            with suppress(OSError):
                if _is_ours(folder) and _is_dead(folder):
                    shutil.rmtree(folder, ignore_errors=True)


def _is_ours(folder: Path) -> bool:
    return not folder.is_symlink() and (os.name == "nt" or folder.stat().st_uid == os.getuid())


def _is_dead(folder: Path) -> bool:
    """Whether no process holds its lock. Without one, as older versions made them, nobody knows."""
    with (folder / LOCK).open("r+b") as lock:
        return try_lock(lock.fileno())
