# SPDX-License-Identifier: GPL-3.0-or-later
"""Precomputations: run once for each hash of their inputs, on a thread or while the caller waits."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from .file_cache import FileCache

Progress: TypeAlias = Callable[[float], bool]
"""Takes the progress, 0 to 1. Returns False when the work has to end."""

Make: TypeAlias = Callable[[Progress], np.ndarray | None]
"""Returns None if it was told to end."""

# Results that took longer are stored in the folder.
SECONDS_WORTH_A_FILE = 0.1
# Bytes of results that are kept in memory, so that undo finds them.
MEMORY = 256 * 2**20


class Precomputation:
    """One run, on its own thread or on the one that waits for it.

    make      uses only numpy arrays, which nobody writes to
    result    None until it has ended successfully
    error     the exception of make
    progress  0 to 1
    """

    def __init__(self, key: str, make: Make, ended: Callable[[Precomputation], None]) -> None:
        self.key = key
        self.progress = 0.0
        self.result: np.ndarray | None = None
        self.error: Exception | None = None
        self.seconds = 0.0
        self._make = make
        self._on_end = ended
        self._cancelled = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="Sinew precomputation", daemon=True)

    @property
    def is_cancelled(self) -> bool:
        return self._cancelled.is_set()

    @property
    def has_ended(self) -> bool:
        return self._ended.is_set()

    def start(self) -> None:
        self._thread.start()

    def run_here(self) -> None:
        """Runs on this thread, instead of start()."""
        self._run()

    def cancel(self) -> None:
        """Returns at once; the run ends a moment later, without a result."""
        self._cancelled.set()

    def wait(self) -> None:
        self._ended.wait()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    def _run(self) -> None:
        started = time.perf_counter()
        try:
            self.result = self._make(self._note_progress)
        except Exception as error:
            self.error = error
        except BaseException:
            # For example Ctrl-C on the thread that waits.
            self._cancelled.set()
            raise
        finally:
            self.seconds = time.perf_counter() - started
            self._on_end(self)
            self._ended.set()

    def _note_progress(self, done: float) -> bool:
        self.progress = done
        return not self._cancelled.is_set()


class Precomputations:
    """All precomputations of a process. Any thread may use it.

    waits    results are computed at once while the caller waits: nobody watches, or a render needs them
    cache    the folder that stores results, None for none
    stopped  the keys that the artist has stopped
    """

    def __init__(self, cache: FileCache | None = None) -> None:
        self.waits = True
        self.cache = cache
        self.stopped: set[str] = set()
        self._running: dict[str, Precomputation] = {}
        self._made: OrderedDict[str, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def running(self) -> list[Precomputation]:
        with self._lock:
            return list(self._running.values())

    def find(self, key: str) -> np.ndarray | None:
        """Returns the result of an earlier run, in this process or another; None where there is none."""
        with self._lock:
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
        found = self.cache.load(key) if self.cache is not None else None
        if found is not None:
            self._keep(key, found)
        return found

    def start(self, key: str, make: Make) -> Precomputation:
        """Starts a run on its own thread, or returns the one that already runs with this key."""
        run, is_new = self._run_of(key, make)
        if is_new:
            self.stopped.discard(key)
            run.start()
        return run

    def make_now(self, key: str, make: Make) -> np.ndarray:
        """Waits for the result. Raises what `make` raises."""
        while True:
            run, is_new = self._run_of(key, make)
            if is_new:
                run.run_here()
            run.wait()
            if run.error is not None:
                raise run.error
            # Otherwise somebody cancelled the run.
            if run.result is not None:
                return run.result

    def cancel_all(self) -> None:
        """Ends all runs, and returns when their threads have ended."""
        running = self.running
        for run in running:
            run.cancel()
        for run in running:
            run.wait()

    def stop(self) -> None:
        """Cancels all runs. None of these keys is started again on a thread until it is removed from
        `stopped`."""
        self.stopped |= {run.key for run in self.running}
        self.cancel_all()

    def _run_of(self, key: str, make: Make) -> tuple[Precomputation, bool]:
        with self._lock:
            run = self._running.get(key)
            if run is not None and not run.is_cancelled:
                return run, False
            run = self._running[key] = Precomputation(key, make, self._ended)
            return run, True

    def _ended(self, run: Precomputation) -> None:
        """Called on the thread that ran it."""
        if run.result is not None:
            # Stored before it is no longer listed as running, so that it is always found.
            self._keep(run.key, run.result)
            if self.cache is not None and run.seconds > SECONDS_WORTH_A_FILE:
                self.cache.store(run.key, run.result)
        with self._lock:
            if self._running.get(run.key) is run:
                del self._running[run.key]

    def _keep(self, key: str, made: np.ndarray) -> None:
        with self._lock:
            self._made[key] = made
            self._made.move_to_end(key)
            while len(self._made) > 1 and sum(each.nbytes for each in self._made.values()) > MEMORY:
                self._made.popitem(last=False)


precomputations = Precomputations()
"""The one of this process. In a window, deform/precomputing.py sets `waits`."""
