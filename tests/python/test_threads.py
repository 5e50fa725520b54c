# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects threads that Python did not start, such as Blender's."""

from __future__ import annotations

import ctypes
import sys
import threading

import pytest
import sinew

THREADS = 50


def thread_states() -> int:
    """The number of thread states that Python has."""
    api = ctypes.pythonapi
    for name in ("PyInterpreterState_Get", "PyInterpreterState_ThreadHead", "PyThreadState_Next"):
        getattr(api, name).restype = ctypes.c_void_p
    state = api.PyInterpreterState_ThreadHead(ctypes.c_void_p(api.PyInterpreterState_Get()))
    count = 0
    while state:
        count += 1
        state = api.PyThreadState_Next(ctypes.c_void_p(state))
    return count


@pytest.fixture
def in_foreign_threads():
    """in_foreign_threads(work, count): runs work in this many threads of the system, one after the other."""
    if sys.platform == "win32":
        pytest.skip("no POSIX threads here")
    library = ctypes.CDLL(None)
    entry = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)

    def run(work, count):
        @entry
        def start(_argument):
            work()

        for _ in range(count):
            thread = ctypes.c_ulong()
            assert library.pthread_create(ctypes.byref(thread), None, start, None) == 0
            assert library.pthread_join(thread, None) == 0

    return run


def test_a_kept_state_goes_with_its_thread(in_foreign_threads):
    met = []

    def work():
        before = thread_states()
        sinew.keep_thread_state()
        sinew.keep_thread_state()
        met.append(before)

    before = thread_states()
    in_foreign_threads(work, THREADS)
    assert len(met) == THREADS
    assert thread_states() == before


def test_threads_of_python_keep_their_own():
    before = thread_states()
    for _ in range(THREADS):
        thread = threading.Thread(target=sinew.keep_thread_state)
        thread.start()
        thread.join()
    assert thread_states() == before
