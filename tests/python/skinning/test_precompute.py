# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects who runs precomputations, and the folder that caches their results."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from sinew_addon.base import file_cache
from sinew_addon.skinning import precompute

RESULT = np.arange(12, dtype=np.float32).reshape(-1, 3)


class Run:
    """A precomputation that ends when the test says so."""

    progress = 0.5

    def __init__(self, may_end: bool = True, error: Exception | None = None) -> None:
        self._ended, self._error, self._is_cancelled = threading.Event(), error, False
        if may_end:
            self.end()

    @property
    def has_ended(self) -> bool:
        return self._ended.is_set()

    def end(self) -> None:
        self._ended.set()

    def cancel(self) -> None:
        if not self.has_ended:
            self._is_cancelled = True
            self.end()

    def wait(self, seconds=None) -> bool:
        return self._ended.wait(seconds)

    def result(self):
        assert self.has_ended
        if self._error is not None:
            raise self._error
        return None if self._is_cancelled else RESULT


def run_now(*, gives_way: bool) -> Run:
    assert not gives_way
    return Run()


def test_each_key_runs_once():
    all_of_it, runs = precompute.Precomputations(), [Run(may_end=False), Run()]
    waiting = iter(runs)
    assert all_of_it.start("a", lambda **_how: next(waiting)) is runs[0]
    assert all_of_it.start("a", lambda **_how: next(waiting)) is runs[0]
    assert all_of_it.running == [runs[0]]
    assert all_of_it.find("a") is None
    threading.Timer(0.05, runs[0].end).start()
    assert all_of_it.make_now("a", lambda **_how: next(waiting)) is RESULT
    assert next(waiting) is runs[1]
    assert not all_of_it.running
    assert all_of_it.find("a") is RESULT
    assert all_of_it.find("b") is None


def test_a_result_is_taken_when_somebody_looks():
    all_of_it, run = precompute.Precomputations(), Run(may_end=False)
    all_of_it.start("a", lambda **_how: run)
    run.end()
    assert not all_of_it.running
    assert all_of_it.find("a") is RESULT


def test_a_stopped_one_can_be_computed_again():
    all_of_it, run = precompute.Precomputations(), Run(may_end=False)
    all_of_it.start("a", lambda **_how: run)
    all_of_it.stop()
    assert run.has_ended
    assert all_of_it.stopped == {"a"}
    assert not all_of_it.running
    assert all_of_it.find("a") is None
    assert all_of_it.make_now("a", run_now) is RESULT
    assert not all_of_it.stopped


def test_cancelled_while_somebody_waits_it_starts_again():
    all_of_it, runs = precompute.Precomputations(), [Run(may_end=False), Run()]
    waiting = iter(runs)
    threading.Timer(0.05, runs[0].cancel).start()
    assert all_of_it.make_now("a", lambda **_how: next(waiting)) is RESULT
    assert not list(waiting)


def test_ctrl_c_cancels_it(monkeypatch):
    monkeypatch.setattr(precompute.interrupt, "_requested", True)
    all_of_it, run = precompute.Precomputations(), Run(may_end=False)
    with pytest.raises(precompute.SinewError, match="Ctrl-C"):
        all_of_it.make_now("a", lambda **_how: run)
    assert run.has_ended
    assert not all_of_it.running


def test_errors_are_those_of_who_waits():
    all_of_it = precompute.Precomputations()
    run = all_of_it.start("a", lambda **_how: Run(error=ValueError("no such mesh")))
    assert not all_of_it.running
    with pytest.raises(ValueError, match="no such mesh"):
        run.result()
    with pytest.raises(ValueError, match="no such mesh"):
        all_of_it.make_now("a", lambda **_how: run)


def test_memory_is_limited(monkeypatch):
    monkeypatch.setattr(precompute, "MEMORY", 3 * RESULT.nbytes)
    all_of_it = precompute.Precomputations()
    for key in "abcd":
        all_of_it.make_now(key, run_now)
    assert [all_of_it.find(key) is not None for key in "abcd"] == [False, True, True, True]


def test_another_process_finds_slow_results(tmp_path, monkeypatch):
    monkeypatch.setattr(precompute, "SECONDS_WORTH_A_FILE", 0.0)
    first, other = (precompute.Precomputations(file_cache.FileCache(tmp_path, 10**6)) for _ in range(2))
    first.make_now("a", run_now)
    np.testing.assert_array_equal(other.find("a"), RESULT)


# --- The folder


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content[:-1],
        lambda content: content[: len(content) // 2],
        lambda _content: b"",
        lambda content: content[:-5] + bytes([content[-5] ^ 1]) + content[-4:],
        lambda content: b"OTHER 1\n" + content[8:],
    ],
)
def test_a_damaged_file_is_none(tmp_path, damage):
    cache = file_cache.FileCache(tmp_path, 10**6)
    cache.store("a", RESULT)
    (path,) = tmp_path.iterdir()
    path.write_bytes(damage(path.read_bytes()))
    assert cache.load("a") is None
    assert not list(tmp_path.iterdir())
    cache.store("a", RESULT)
    np.testing.assert_array_equal(cache.load("a"), RESULT)


def test_the_least_recently_used_file_is_removed_first(tmp_path):
    one = 200 + RESULT.nbytes
    cache = file_cache.FileCache(tmp_path, 3 * one)
    for age, key in enumerate("abc"):
        cache.store(key, RESULT)
        os.utime(tmp_path / f"{key}.sinew", (1000.0 + age, 1000.0 + age))
    assert cache.load("a") is not None
    cache.store("d", RESULT)
    assert [cache.load(key) is not None for key in "abcd"] == [True, False, True, True]
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= cache.limit


def test_results_beyond_the_limit_are_not_stored(tmp_path):
    cache = file_cache.FileCache(tmp_path, 100)
    cache.store("a", RESULT)
    assert not list(tmp_path.iterdir())


def test_files_of_killed_processes_are_removed(tmp_path):
    old, new = tmp_path / ".old.sinew", tmp_path / ".new.sinew"
    for path in (old, new):
        path.write_bytes(b"half")
    os.utime(old, (1000.0, 1000.0))
    file_cache.FileCache(tmp_path, 10**6).store("a", RESULT)
    assert not old.exists()
    assert new.exists()


def test_a_folder_that_can_not_be_made_is_no_error(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    cache = file_cache.FileCache(tmp_path / "file" / "folder", 10**6)
    cache.store("a", RESULT)
    assert cache.load("a") is None


WRITER = """
import sys
from pathlib import Path
import numpy as np
from sinew_addon.base.file_cache import FileCache
cache = FileCache(Path(sys.argv[1]), 40_000)
for number in range(300):
    key = f"key{number % 7}"
    found = cache.load(key)
    assert found is None or (found == number % 7).all(), found
    cache.store(key, np.full((500, 3), number % 7, np.float32))
"""


def test_several_processes_share_the_folder(tmp_path):
    """No process ever reads a file that another has half written."""
    running = [
        subprocess.Popen([sys.executable, "-c", WRITER, tmp_path], stderr=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    for process in running:
        _out, errors = process.communicate(timeout=60)
        assert process.returncode == 0, errors
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 40_000
