# SPDX-License-Identifier: GPL-3.0-or-later
"""Threads that Python did not start, such as Blender's, and what Python keeps of threads."""

import ctypes
from collections.abc import Callable


def thread_states() -> int:
    """How many thread states Python keeps, for live and dead threads."""
    api = ctypes.pythonapi
    for name in ("PyInterpreterState_Main", "PyInterpreterState_ThreadHead", "PyThreadState_Next"):
        getattr(api, name).restype = ctypes.c_void_p
    state = api.PyInterpreterState_ThreadHead(ctypes.c_void_p(api.PyInterpreterState_Main()))
    count = 0
    while state:
        count += 1
        state = api.PyThreadState_Next(ctypes.c_void_p(state))
    return count


def in_foreign_threads(work: Callable[[], None], count: int) -> None:
    """Runs work in this many threads of the system, one after the other. Needs POSIX threads."""
    library = ctypes.CDLL(None)

    @ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
    def start(_argument: int | None) -> None:
        work()

    for _ in range(count):
        thread = ctypes.c_ulong()
        assert library.pthread_create(ctypes.byref(thread), None, start, None) == 0
        assert library.pthread_join(thread, None) == 0
