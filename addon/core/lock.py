# SPDX-License-Identifier: GPL-3.0-or-later
"""Locks on files, which the system releases however a process ends."""

from __future__ import annotations

import os
import sys


def try_lock(descriptor: int) -> bool:
    """Locks a file for this process alone. False where another process has it, or files can not be locked."""
    try:
        _lock(descriptor)
    except OSError:
        return False
    return True


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        # Beyond any file's end, as Windows lets nobody read what is locked.
        os.lseek(descriptor, 1 << 40, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
