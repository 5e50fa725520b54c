# SPDX-License-Identifier: GPL-3.0-or-later
"""Precomputations: run once for each hash of what they take, beside the artist's work or at once."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from .file_cache import FileCache

Progress: TypeAlias = Callable[[float], bool]
"""Takes the share that is done, 0 to 1. False: the work is to end."""

Make: TypeAlias = Callable[[Progress], np.ndarray | None]
"""None where it was told to end."""

# What takes longer is kept in the folder.
SECONDS_WORTH_A_FILE = 0.1
# Bytes of results that are kept in memory, so that undo finds them.
MEMORY = 256 * 2**20


class Precomputation:
    """One run, on a thread of its own or on the one that waits for it.

    make  sees numpy arrays alone, which nobody writes to

    result           None until it has ended well
    error            what make raised
    progress         the share that is done, 0 to 1
    """

    def __init__(self, key: str, make: Make, ended: Callable[[Precomputation], None]) -> None:
        self.key = key
        self.progress = 0.0
        self.result: np.ndarray | None = None
        self.error: Exception | None = None
        self.seconds = 0.0
        self._make = make
        self._tell_end = ended
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
        """Instead of start()."""
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
            # Ctrl-C on the thread that waits.
            self._cancelled.set()
            raise
        finally:
            self.seconds = time.perf_counter() - started
            self._tell_end(self)
            self._ended.set()

    def _note_progress(self, done: float) -> bool:
        self.progress = done
        return not self._cancelled.is_set()


class Precomputations:
    """All of a process. Any thread may ask.

    waits    who needs a result has it computed at once and waits: nobody watches, or a render needs it
    cache    the folder that keeps results, None for none
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
        """The result of an earlier run, of this process or another."""
        with self._lock:
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
        found = self.cache.load(key) if self.cache is not None else None
        if found is not None:
            self._keep(key, found)
        return found

    def start(self, key: str, make: Make) -> Precomputation:
        """On a thread of its own; the one that runs already where there is one of this key."""
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
            # Else somebody cancelled the run that was waited for.
            if run.result is not None:
                return run.result

    def cancel_all(self) -> None:
        """Ends all runs, and returns when their threads are gone."""
        running = self.running
        for run in running:
            run.cancel()
        for run in running:
            run.wait()

    def stop(self) -> None:
        """As cancel_all(); none of these keys is started again on a thread of its own, until it is taken out
        of `stopped`."""
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
        """On the thread that ran it."""
        if run.result is not None:
            # Found from now on, before it is no longer running.
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
"""Of this process. In a window, deform/precomputing.py decides who waits."""
