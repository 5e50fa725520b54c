# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects who runs precomputations."""

from __future__ import annotations

import importlib
import sys
import threading
import types
from pathlib import Path

import numpy as np
import pytest

# The package around these files imports bpy; the files do not.
_CORE = Path(__file__).resolve().parents[2] / "addon" / "core"
_PACKAGE = types.ModuleType("sinew_precompute_core")
_PACKAGE.__path__ = [str(_CORE)]
sys.modules["sinew_precompute_core"] = _PACKAGE
precompute = importlib.import_module("sinew_precompute_core.precompute")

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
