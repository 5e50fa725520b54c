# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by all measurements: the machine's description, alternating candidates, JSON and tables."""

from __future__ import annotations

import json
import os
import platform
import re
import statistics
import time
from collections.abc import Callable
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
    """The least and the median; the load of other programs changes the median, and hardly the least."""
    return {"least": min(times), "median": statistics.median(times), "runs": len(times)}


def alternate(candidates: dict, seconds: float, clock: Callable[[], float] = time.perf_counter) -> dict:
    """Calls the functions of {name: function} alternately, for `seconds` each: {name: spread() of seconds a
    call}. Each runs for some calls at a time: the first of these has to fill the caches again. What a
    function has as `prepare` is called before it, out of the time, which is `clock`'s."""
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


def heading(text: str, facts: dict) -> None:
    print(f"== {text} ==\n" + ", ".join(f"{key}: {value}" for key, value in facts.items()) + "\n", flush=True)
