# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the measurements of the kernels, prints them as a table of ratios and keeps them as JSON."""

import argparse
import json
import platform
import re
import subprocess
import sys
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
METHODS = ("lbs", "qv", "dq")
KINDS = ("chain", "shuffled", "character")


def processor():
    try:
        found = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found.group(1) if found else platform.processor() or platform.machine()


def run(program, repetitions, options):
    # Interleaved, so that a neighbour's load falls on all candidates alike.
    command = [
        program,
        "--benchmark_format=json",
        f"--benchmark_repetitions={repetitions}",
        "--benchmark_enable_random_interleaving=true",
        "--benchmark_min_time=0.02",
        *options,
    ]
    report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    medians = {}
    for row in report["benchmarks"]:
        if row.get("aggregate_name") == "median":
            medians[row["run_name"].removesuffix("/real_time")] = row["real_time"]
    return report["context"], medians


def table(medians):
    """Lines of text; nanoseconds a vertex and ratios."""
    lines = [f"{'':28}{'plain':>8}{'sinew':>8}{'2 threads':>11}{'sinew is':>11}{'2 are':>8}"]
    for kind in KINDS:
        sizes = sorted({int(name.split("/")[3]) for name in medians if f"/{kind}/" in name})
        for size in sizes:
            for method in METHODS:
                key = f"{method}/{kind}/{size}"
                times = [medians.get(f"{who}/{key}") for who in ("plain", "sinew1", "sinew2")]
                if None in times:
                    continue
                plain, one, two = (time / size for time in times)
                lines.append(
                    f"{kind:10}{size:>9,}  {method:7}{plain:8.2f}{one:8.2f}{two:11.2f}"
                    f"{plain / one:9.1f} x{one / two:6.2f} x"
                )
    for name, time in medians.items():
        if name.startswith(("bind/", "rest/")):
            size = int(name.split("/")[3])
            lines.append(f"{name:40}{time / 1e6:8.2f} ms, {time / size:.1f} ns a vertex")
    if "pool" in medians:
        lines.append(f"{'a call of the thread pool':40}{medians['pool'] / 1e3:8.2f} us")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=Path)
    parser.add_argument("--repetitions", type=int, default=9)
    parser.add_argument("--name", default="kernels", help="of the file in bench/results")
    arguments, options = parser.parse_known_args()
    context, medians = run(arguments.program, arguments.repetitions, options)
    machine = {
        "processor": processor(),
        "system": platform.platform(),
        **{key: context[key] for key in ("num_cpus", "load_avg", "simd", "compiler", "flags", "plain_flags")},
    }
    print(*(f"{key}: {value}" for key, value in machine.items()), sep="\n")
    print("\nnanoseconds a vertex, medians; 'plain' is the loop over glm of bench/plain_loops.cpp\n")
    print(*table(medians), sep="\n")
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{arguments.name}.json"
    path.write_text(json.dumps({"machine": machine, "median_ns_a_call": medians}, indent=1) + "\n")
    print(f"\n{path}")


if __name__ == "__main__":
    sys.exit(main())
