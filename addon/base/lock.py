# SPDX-License-Identifier: GPL-3.0-or-later
"""File locks that the system releases when a process ends, even if it is killed."""

import os
import sys


def try_lock(descriptor: int) -> bool:
    """Locks a file for this process alone. Returns False where another process has the lock, or files cannot
    be locked."""
    try:
        _lock(descriptor)
    except OSError:
        return False
    return True


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        # A byte beyond any file's end, as on Windows others cannot read locked bytes.
        os.lseek(descriptor, 1 << 40, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
