# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the times of the kernels and of plain loops: a table of ratios, and JSON."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path

import common

KINDS = ("chain", "shuffled", "character")
SIZES = (1_000, 10_000, 100_000, 1_000_000, 8_000_000)
LOOPS = ("glm", "eigen")


def run(
    program: Path, pattern: str, repetitions: int, options: list[str], seconds: float = 0.001
) -> tuple[dict, dict]:
    """({context}, {name: spread() of nanoseconds per call}) for the benchmarks that match `pattern`.

    seconds  duration of one repetition, which calls the function many times
    """
    # Interleaved, so that the load of other programs affects all candidates equally.
    command = [
        program,
        "--benchmark_format=json",
        f"--benchmark_filter={pattern}",
        f"--benchmark_repetitions={repetitions}",
        "--benchmark_enable_random_interleaving=true",
        f"--benchmark_min_time={seconds}",
        *options,
    ]
    report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    times = {}
    for row in report["benchmarks"]:
        if row["run_type"] == "iteration":
            times.setdefault(row["run_name"].removesuffix("/real_time"), []).append(row["real_time"])
    return report["context"], {name: common.spread(of) for name, of in times.items()}


def rows(kind: str, size: int, times: dict) -> list[str]:
    """A line for each measured method, and for what follows methods; nan for those without plain loops."""
    scene = f"{kind}/{size}"
    of_lbs = times[f"glm/lbs/{scene}"]["least"] / size
    lines = []
    for method in dict.fromkeys(name.split("/")[1] for name in times if name.startswith("sinew1/")):
        glm, eigen, one, two = (
            times.get(f"{who}/{method}/{kind}/{size}", {"least": math.nan})["least"] / size
            for who in (*LOOPS, "sinew1", "sinew2")
        )
        lines.append(
            f"{kind:10}{size:>10,}  {method:5}{glm:8.2f}{eigen:8.2f}{one:8.2f}{two:8.2f}"
            f"{glm / one:9.1f} x{eigen / one:8.1f} x{one / two:8.2f} x{one / of_lbs:10.2f}"
        )
    for name, time in times.items():
        if name.startswith("stage/") and name.endswith(scene):
            one = time["least"] / size
            lines.append(f"{kind:10}{size:>10,}  {name.split('/')[1]:21}{one:8.2f}{one / of_lbs:47.2f}")
    return lines


def main() -> None:
    parser = common.options(__doc__, "kernels", "100,000 vertices only")
    parser.add_argument("program", type=Path)
    parser.add_argument("--simd", help="another instruction set than the best")
    arguments = parser.parse_args()
    options = [f"--simd={arguments.simd}"] if arguments.simd else []
    context, times = run(arguments.program, "^pool", 5, options)
    facts = common.begin("kernels", **{k: context[k] for k in ("simd", "compiler", "flags", "plain_flags")})
    print("Nanoseconds a vertex, the least of many runs. The loops are one's first with GLM and with Eigen,")
    print("of four influences always, with plain_flags; ours is built as it is shipped. The last column is")
    print("ours on one thread over GLM's loop for lbs.\n")
    head = f"{'glm':>8}{'eigen':>8}{'sinew':>8}{'2 thr.':>8}{'than glm':>11}{'eigen':>10}{'2 threads':>10}"
    print(f"{'':27}{head}{'of glm lbs':>12}")
    for kind in KINDS:
        for size in (100_000,) if arguments.quick else SIZES:
            if size > 1_000_000 and kind != "chain":
                continue
            # Short repetitions, so that some run without interruption. Large meshes need more calls until
            # their data is in the caches as after a previous call.
            repetitions, seconds = {1_000_000: (40, 0.005), 8_000_000: (8, 0.05)}.get(size, (60, 0.001))
            if arguments.quick:
                repetitions = 20
            found = run(arguments.program, f"/{kind}/{size}/", repetitions, options, seconds)[1]
            print(*rows(kind, size, found), sep="\n", flush=True)
            times |= found
    print()
    for name, time in times.items():
        what, *scene = name.split("/")
        if what in ("bind", "rest"):
            text = {"bind": "binding", "rest": "new rest points"}[what]
            print(f"{text:16}{scene[1]:10}{int(scene[2]):>10,}{time['least'] / 1e6:9.2f} ms")
    print(f"a call of the thread pool{times['pool']['least'] / 1e3:20.2f} us")
    common.write(arguments.name, machine=facts, nanoseconds=times)


if __name__ == "__main__":
    main()
