# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by all benchmarks: options, the machine's description, alternating candidates, JSON and tables."""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path

RESULTS = Path(__file__).parent / "results"


def machine() -> dict:
    try:
        found = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        found = None
    return {
        "processor": found.group(1) if found else platform.processor() or platform.machine(),
        "cpus": os.cpu_count(),
        "system": platform.platform(),
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
    }


def version_of(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def spread(times: list[float]) -> dict:
    """The minimum and the median. The load of other programs changes the median, but hardly the minimum."""
    return {"least": min(times), "median": statistics.median(times), "runs": len(times)}


def alternate(candidates: dict, seconds: float, clock: Callable[[], float] = time.perf_counter) -> dict:
    """Calls the functions of {name: function} alternately, for `seconds` each. Returns {name: spread() of
    seconds per call}. Each function is called several times in a row, of which the first call fills the
    caches. If a function has an attribute `prepare`, that is called before it, outside of the time, which
    `clock` measures."""
    times = {name: [] for name in candidates}
    end = time.perf_counter() + seconds * len(candidates)
    while time.perf_counter() < end:
        for name, call in candidates.items():
            prepare = getattr(call, "prepare", lambda: None)
            round_end = time.perf_counter() + 0.01
            prepare()
            call()
            while True:
                prepare()
                start = clock()
                call()
                times[name].append(clock() - start)
                if time.perf_counter() > round_end:
                    break
    return {name: spread(of) for name, of in times.items()}


def write(name: str, **content) -> None:
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps(content, indent=1) + "\n")
    print(f"\n{path}\n")


def options(about: str | None, name: str, quick: str = "") -> argparse.ArgumentParser:
    """A parser with --name, and with --quick where a text says what that does."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--name", default=name, help="of the file in bench/results")
    if quick:
        parser.add_argument("--quick", action="store_true", help=quick)
    return parser


def begin(title: str, **facts) -> dict:
    """Prints what is measured, and returns where: the machine and these facts."""
    facts = machine() | facts
    print(
        f"== {title} ==\n" + ", ".join(f"{key}: {value}" for key, value in facts.items()) + "\n", flush=True
    )
    return facts


@contextmanager
def registered() -> Iterator[None]:
    """With Sinew in Blender. Blender's own cleanup crashes 4.2 and hangs 4.5 while it is registered."""
    import sinew_addon

    sinew_addon.register()
    try:
        yield
    finally:
        sinew_addon.unregister()
