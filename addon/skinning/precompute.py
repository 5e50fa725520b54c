# SPDX-License-Identifier: GPL-3.0-or-later
"""Precomputations: run once for each hash of their inputs, by threads of the native library. Whoever asks for
one of them has the results of all that have ended taken."""

import time
from collections import OrderedDict
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import sinew

from ..base import interrupt
from ..base.errors import SinewError
from ..base.file_cache import FileCache

Start: TypeAlias = Callable[..., sinew.Precomputation]
"""Takes `gives_way`: whether the artist works meanwhile."""

# Results that took longer are stored in the folder.
SECONDS_WORTH_A_FILE = 0.1
# Bytes of results that are kept in memory, so that undo finds them.
MEMORY = 256 * 2**20
_SECONDS_BETWEEN_CHECKS = 0.05


class Precomputations:
    """All precomputations of a process. Any thread may use it.

    blocks   results are computed at once while the caller waits: nobody watches, or a render needs them
    cache    the folder that stores results, None for none
    stopped  the keys that the artist has stopped
    """

    def __init__(self, cache: FileCache | None = None) -> None:
        self.blocks = True
        self.cache = cache
        self.stopped: set[str] = set()
        # With the time of its start. time.monotonic() has steps of 16 ms on Windows before Python 3.13.
        self._running: dict[str, tuple[sinew.Precomputation, float]] = {}
        self._made: OrderedDict[str, np.ndarray] = OrderedDict()
        self._lock = sinew.Lock()

    @property
    def running(self) -> list[sinew.Precomputation]:
        with self._lock:
            self._take_results()
            return [run for run, _started in self._running.values()]

    def find(self, key: str) -> np.ndarray | None:
        """Returns the result of an earlier run, in this process or another; None where there is none."""
        with self._lock:
            self._take_results()
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
            found = self.cache.load(key) if self.cache is not None else None
            if found is not None:
                self._keep(key, found)
            return found

    def start(self, key: str, start: Start, gives_way: bool = True) -> sinew.Precomputation:
        """Starts a run, or returns the one that already runs with this key."""
        with self._lock:
            self._take_results()
            if key not in self._running:
                self.stopped.discard(key)
                self._running[key] = start(gives_way=gives_way), time.perf_counter()
            return self._running[key][0]

    def make_now(self, key: str, start: Start) -> np.ndarray:
        """Waits for the result. Raises what the run raises, and SinewError where Ctrl-C was pressed: Blender
        prints a KeyboardInterrupt in its handlers, and goes on."""
        while True:
            run = self.start(key, start, gives_way=False)
            try:
                while not run.wait(_SECONDS_BETWEEN_CHECKS):
                    if interrupt.is_requested():
                        raise SinewError("stopped by Ctrl-C")
            except BaseException:
                run.cancel()
                raise
            made = run.result()
            # Otherwise somebody cancelled the run.
            if made is not None:
                with self._lock:
                    self._take_results()
                return made

    def cancel_all(self) -> None:
        for run in self.running:
            run.cancel()

    def stop(self) -> None:
        """Cancels all runs. In a window none of these keys is started again while it is in `stopped`."""
        with self._lock:
            self._take_results()
            self.stopped |= self._running.keys()
            self.cancel_all()

    def _take_results(self) -> None:
        for key, (run, started) in list(self._running.items()):
            if not run.has_ended:
                continue
            del self._running[key]
            try:
                made = run.result()
            except Exception:
                # Raised again for whoever started it.
                continue
            if made is not None:
                self._keep(key, made)
                if self.cache is not None and time.perf_counter() - started > SECONDS_WORTH_A_FILE:
                    self.cache.store(key, made)

    def _keep(self, key: str, made: np.ndarray) -> None:
        self._made[key] = made
        self._made.move_to_end(key)
        while len(self._made) > 1 and sum(each.nbytes for each in self._made.values()) > MEMORY:
            self._made.popitem(last=False)


precomputations = Precomputations()
"""The one of this process. In a window, deform/precomputing.py sets `blocks`."""
