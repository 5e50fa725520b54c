# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the programs of experiments/: counted operations, and the loops of the timing tables."""

from __future__ import annotations

import json
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sinew_addon.base.errors import SinewError

sys.path.append(str(Path(__file__).resolve().parents[2] / "bench"))
import common

PROGRAMS = ("operation_counts", "timings_optimised", "timings_unoptimised")
# The extension of programs.
SUFFIX = ".exe" if sys.platform == "win32" else ""
# Without optimisation Eigen takes minutes, and is irrelevant to the report, which used GLM.
UNOPTIMISED = r"^3\.(4|5|10)/(plain|glm|sinew)|^3\.9/(plain|glm|sinew_(matrix_linear|qv|dlb|sclerp))"
# The number of operations in one loop of each table.
OPERATIONS = {"3.4": 5 * 100_000, "3.5": 1_000_000, "3.9": 1_000_000, "3.10": 1_000_000}


@dataclass(frozen=True)
class Timing:
    """Processor seconds for a whole loop: the median of all runs, the fastest run, the interquartile range.

    Times of a shortened loop are multiplied by the factor by which it was shortened.
    """

    median: float
    fastest: float
    spread: float

    @classmethod
    def of(cls, times: Sequence[float]) -> Timing:
        low, high = np.quantile(times, (0.25, 0.75))
        return cls(statistics.median(times), min(times), float(high - low))


@dataclass(frozen=True)
class Measurements:
    """The results of the programs.

    counts       operations, by table, name and kind
    optimised    by "table/name", from the optimised build
    unoptimised  the same without optimisation, for fewer candidates
    """

    counts: dict[str, dict[str, dict[str, int]]]
    optimised: dict[str, Timing]
    unoptimised: dict[str, Timing]
    build: dict[str, str]


def machine() -> dict[str, str]:
    """Returns processor, system and Python."""
    found = common.machine()
    return {**{name: found[name] for name in ("processor", "system")}, "Python": platform.python_version()}


def measure(programs: Path, quick: bool, step: Callable[[str], None]) -> Measurements:
    """Runs the programs in the folder `programs`; takes some 90 seconds, `quick` less than one.

    step  called with a description before each step

    Raises SinewError where a program does not exist or fails.
    """
    # The system would search elsewhere for a program without a path.
    found = {name: programs.resolve() / f"{name}{SUFFIX}" for name in PROGRAMS}
    for name, program in found.items():
        if not program.is_file():
            raise SinewError(f"{programs}: has no program {name}; ./dev report builds it")
    step("Counting operations")
    counts = json.loads(_output([found["operation_counts"]]))
    step("Timing the report's loops, optimised")
    optimised, context = _timings(found["timings_optimised"], 1 if quick else 15, quick)
    step("Timing them without optimisation")
    only = f"--benchmark_filter={UNOPTIMISED}"
    unoptimised, plain_context = _timings(found["timings_unoptimised"], 1 if quick else 5, quick, only)
    build = {
        "compiler": context["compiler"],
        "optimised": context["flags"],
        "without optimisation": plain_context["flags"],
        "load average": ", ".join(f"{load:.1f}" for load in context.get("load_avg", ())) or "unknown",
    }
    return Measurements(counts, optimised, unoptimised, build)


def _timings(program: Path, repetitions: int, quick: bool, *options: str) -> tuple[dict[str, Timing], dict]:
    shorten = 1000 if quick else 1
    # Interleaved, so that other load on the machine affects all candidates alike.
    result = json.loads(
        _output(
            [
                program,
                "--benchmark_format=json",
                f"--benchmark_repetitions={repetitions}",
                "--benchmark_enable_random_interleaving=true",
                f"--shorten={shorten}",
                *options,
            ]
        )
    )
    runs: dict[str, list[float]] = {}
    for run in result["benchmarks"]:
        if run["run_type"] == "iteration":
            name = "/".join(run["run_name"].split("/")[:2])
            runs.setdefault(name, []).append(run["cpu_time"] * 1e-9 * shorten)
    return {name: Timing.of(times) for name, times in runs.items()}, result["context"]


def _output(command: Sequence[object]) -> str:
    try:
        done = subprocess.run(
            [str(word) for word in command], capture_output=True, text=True, check=False, timeout=600
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SinewError(f"{command[0]}: can not run: {error}") from None
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["it says nothing"])[-1]
        raise SinewError(f"{command[0]}: failed with status {done.returncode}: {last}")
    return done.stdout
