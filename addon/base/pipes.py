# SPDX-License-Identifier: GPL-3.0-or-later
"""Waits for pipes of child processes without threads; a pipe is a file descriptor. select() takes none on
Windows."""

import sys
import time
from collections.abc import Sequence

if sys.platform == "win32":
    import ctypes
    import msvcrt
    from ctypes import wintypes

    # Seconds between two looks.
    _PAUSE = 0.01

    def can_read(pipe: int) -> bool:
        """Whether reading does not wait: there are bytes, or the other end is closed."""
        handle = msvcrt.get_osfhandle(pipe)
        count = wintypes.DWORD()
        peek = ctypes.windll.kernel32.PeekNamedPipe
        return not peek(wintypes.HANDLE(handle), None, 0, None, ctypes.byref(count), None) or count.value > 0

    def wait_for_any(pipes: Sequence[int], seconds: float) -> None:
        """Returns when one of them can be read, and after this time at the latest."""
        end = time.monotonic() + seconds
        while not any(map(can_read, pipes)) and time.monotonic() < end:
            time.sleep(_PAUSE)

else:
    import select

    def can_read(pipe: int) -> bool:
        """Whether reading does not wait: there are bytes, or the other end is closed."""
        # Not select(), which takes no descriptors from 1024 on.
        poll = select.poll()
        poll.register(pipe, select.POLLIN)
        return bool(poll.poll(0))

    def wait_for_any(pipes: Sequence[int], seconds: float) -> None:
        """Returns when one of them can be read, and after this time at the latest."""
        poll = select.poll()
        for pipe in pipes:
            poll.register(pipe, select.POLLIN)
        poll.poll(1000.0 * seconds)
