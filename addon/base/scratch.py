# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary folders, in the system's temporary folder.

A killed run cannot remove its folder, so the next run does. A file lock shows whether a run is alive; unlike
a process id, it works across containers that share the temporary folder.
"""

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
    """A folder that exists until remove(), or until a later run finds that its process has ended. Raises
    OSError where it cannot be made."""

    def __init__(self) -> None:
        _remove_leftovers()
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        # Renamed last, so that another run only ever finds a locked file. Windows cannot rename an open file.
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
        """Removes what can be removed: Windows keeps files that a process has open."""
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
def _remove_leftovers() -> None:
    """Removes this user's folders of killed runs; once per process."""
    with suppress(OSError):
        for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
            with suppress(OSError):
                if _is_ours(folder) and _is_dead(folder):
                    shutil.rmtree(folder, ignore_errors=True)


def _is_ours(folder: Path) -> bool:
    return not folder.is_symlink() and (os.name == "nt" or folder.stat().st_uid == os.getuid())


def _is_dead(folder: Path) -> bool:
    """Whether no process has its lock. Raises OSError for a folder of others, without a lock file."""
    with (folder / LOCK).open("r+b") as lock:
        return try_lock(lock.fileno())
