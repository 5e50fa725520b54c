# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects threads that Python did not start, such as Blender's, and their lock."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

import pytest
import sinew
from python_threads import in_foreign_threads, thread_states

THREADS = 50


needs_posix = pytest.mark.skipif(sys.platform == "win32", reason="no POSIX threads here")


@needs_posix
def test_a_kept_state_goes_with_its_thread():
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


@needs_posix
def test_each_thread_has_its_number():
    met = []
    in_foreign_threads(lambda: met.append(sinew.thread_id() == sinew.thread_id()), 3)
    thread = threading.Thread(target=lambda: met.append(sinew.thread_id()))
    thread.start()
    thread.join()
    *are_same, other = met
    assert are_same == [True] * 3
    assert other != sinew.thread_id()


def test_one_thread_at_a_time_has_the_lock():
    lock, inside, most = sinew.Lock(), [], []

    def work():
        for _ in range(200):
            with lock, lock:
                inside.append(None)
                most.append(len(inside))
                time.sleep(0)
                inside.pop()

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(most) == 800
    assert set(most) == {1}


def test_an_error_frees_the_lock():
    lock = sinew.Lock()
    with pytest.raises(ValueError, match="inside"), lock:
        raise ValueError("inside")
    thread = threading.Thread(target=lock.__enter__, daemon=True)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()


@pytest.mark.skipif(sys.platform == "win32", reason="no forks here")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_forked_child_finds_the_lock_free():
    lock, is_held, may_go = sinew.Lock(), threading.Event(), threading.Event()

    def hold():
        with lock:
            is_held.set()
            assert may_go.wait(60)

    thread = threading.Thread(target=hold)
    thread.start()
    assert is_held.wait(60)
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        with lock:
            os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    may_go.set()
    thread.join(60)
    with lock:
        pass
