# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects precomputations on threads, and the folder that caches their results."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest

# The package around these files imports bpy; the files do not.
_CORE = Path(__file__).resolve().parents[2] / "addon" / "core"
_PACKAGE = types.ModuleType("sinew_precompute_core")
_PACKAGE.__path__ = [str(_CORE)]
sys.modules["sinew_precompute_core"] = _PACKAGE
file_cache = importlib.import_module("sinew_precompute_core.file_cache")
precompute = importlib.import_module("sinew_precompute_core.precompute")

RESULT = np.arange(12, dtype=np.float32).reshape(-1, 3)


def counted(calls: list):
    def make(progress):
        calls.append(threading.current_thread())
        assert progress(0.5)
        return RESULT.copy()

    return make


def until_cancelled(begun: threading.Event):
    def make(progress):
        begun.set()
        while progress(0.25):
            time.sleep(0.001)

    return make


def test_each_key_runs_once_on_its_own_thread():
    calls, all_of_it = [], precompute.Precomputations()
    run = all_of_it.start("a", counted(calls))
    run.wait()
    np.testing.assert_array_equal(run.result, RESULT)
    assert run.progress == 0.5
    assert calls[0] is not threading.current_thread()
    np.testing.assert_array_equal(all_of_it.find("a"), RESULT)
    assert all_of_it.find("b") is None
    assert not all_of_it.running


def test_waiting_computes_on_the_waiting_thread():
    calls, all_of_it = [], precompute.Precomputations()
    np.testing.assert_array_equal(all_of_it.make_now("a", counted(calls)), RESULT)
    assert calls == [threading.current_thread()]


def test_waiting_for_a_running_one_starts_no_other():
    all_of_it, go = precompute.Precomputations(), threading.Event()
    calls = []

    def make(_progress):
        calls.append(None)
        assert go.wait(10)
        return RESULT

    run = all_of_it.start("a", make)
    assert all_of_it.start("a", make) is run
    threading.Timer(0.05, go.set).start()
    assert all_of_it.make_now("a", make) is RESULT
    assert len(calls) == 1


def test_a_stopped_one_can_be_computed_again():
    all_of_it, begun = precompute.Precomputations(), threading.Event()
    run = all_of_it.start("a", until_cancelled(begun))
    assert begun.wait(10)
    all_of_it.stop()
    assert run.has_ended
    assert run.result is None
    assert all_of_it.stopped == {"a"}
    assert not [thread for thread in threading.enumerate() if thread.name == "Sinew precomputation"]
    np.testing.assert_array_equal(all_of_it.make_now("a", counted([])), RESULT)


def test_errors_are_reported():
    def make(_progress):
        raise ValueError("no such mesh")

    all_of_it = precompute.Precomputations()
    run = all_of_it.start("a", make)
    run.wait()
    assert str(run.error) == "no such mesh"
    with pytest.raises(ValueError, match="no such mesh"):
        all_of_it.make_now("a", make)


def test_memory_is_limited(monkeypatch):
    monkeypatch.setattr(precompute, "MEMORY", 3 * RESULT.nbytes)
    all_of_it = precompute.Precomputations()
    for key in "abcd":
        all_of_it.make_now(key, counted([]))
    assert [all_of_it.find(key) is not None for key in "abcd"] == [False, True, True, True]


def test_another_process_finds_slow_results(tmp_path, monkeypatch):
    monkeypatch.setattr(precompute, "SECONDS_WORTH_A_FILE", 0.0)
    first, other = (precompute.Precomputations(file_cache.FileCache(tmp_path, 10**6)) for _ in range(2))
    first.make_now("a", counted([]))
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
import importlib, sys, types
import numpy as np
package = types.ModuleType("core"); package.__path__ = [sys.argv[1]]; sys.modules["core"] = package
from pathlib import Path
cache = importlib.import_module("core.file_cache").FileCache(Path(sys.argv[2]), 40_000)
for number in range(300):
    key = f"key{number % 7}"
    found = cache.load(key)
    assert found is None or (found == number % 7).all(), found
    cache.store(key, np.full((500, 3), number % 7, np.float32))
"""


def test_several_processes_share_the_folder(tmp_path):
    """No process ever reads a file that another has half written."""
    running = [
        subprocess.Popen([sys.executable, "-c", WRITER, _CORE, tmp_path], stderr=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    for process in running:
        _out, errors = process.communicate(timeout=60)
        assert process.returncode == 0, errors
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 40_000
