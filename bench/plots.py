# SPDX-License-Identifier: GPL-3.0-or-later
"""What a vertex costs against influences and against bones: two plots in docs/, a table and JSON."""

from __future__ import annotations

import argparse
from pathlib import Path

import common
import kernels
import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

DOCS = Path(__file__).resolve().parents[1] / "docs"
COLOURS = {"lbs": "#4477aa", "qv": "#ccbb44", "dq": "#ee6677"}
MARKERS = {"lbs": "o", "qv": "s", "dq": "^"}
INFLUENCES = ("1", "2", "3", "4", "6", "8", "mixed")
BONES = (10, 30, 100, 300, 1000)
VERTICES = 100_000


def pairs() -> list[tuple[str, int]]:
    return [(influences, 100) for influences in INFLUENCES] + [("4", bones) for bones in BONES if bones != 100]


def costs(program: Path, options: list[str]) -> tuple[dict, dict]:
    """({context}, {"method/influences/bones": nanoseconds a vertex}), the least of many runs."""
    context, found = {}, {}
    for influences, bones in pairs():
        context, times = kernels.run(program, f"^cost/[a-z]*/{influences}/{bones}/", 40, options)
        for name, spread in times.items():
            found[name.removeprefix("cost/")] = spread["least"] / VERTICES
    return context, found


def draw(name: str, label: str, ticks: list, positions: list, keys, found: dict, logarithmic: bool) -> None:
    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for method in common.METHODS:
        values = [found[f"{method}/{key}"] for key in keys]
        joined = [i for i, tick in enumerate(ticks) if tick != "mixed"]
        style = {"color": COLOURS[method], "marker": MARKERS[method]}
        axes.plot([positions[i] for i in joined], [values[i] for i in joined], label=method, **style)
        for i in set(range(len(ticks))) - set(joined):
            axes.plot(positions[i], values[i], linestyle="none", **style)
    if logarithmic:
        axes.set_xscale("log")
        axes.minorticks_off()
    axes.set_xticks(positions, [str(tick) for tick in ticks])
    axes.set_xlabel(label)
    axes.set_ylabel("nanoseconds a vertex")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, ncols=3, loc="upper left")
    path = DOCS / f"{name}.svg"
    # Without a date, so that the same figures make the same file.
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
    print(path)


def table(found: dict) -> list[str]:
    head = ["influences", "bones", *common.METHODS, "qv / lbs", "dq / lbs"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for influences, bones in pairs():
        lbs, qv, dq = (found[f"{method}/{influences}/{bones}"] for method in common.METHODS)
        ratios = f"{qv / lbs:.2f} | {dq / lbs:.2f}"
        lines.append(f"| {influences} | {bones:,} | {lbs:.2f} | {qv:.2f} | {dq:.2f} | {ratios} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=Path)
    parser.add_argument("--name", default="costs", help="of the file in bench/results")
    parser.add_argument("--simd", help="another instruction set than the best")
    arguments = parser.parse_args()
    plt.rcParams["svg.hashsalt"] = "sinew"
    context, found = costs(arguments.program, [f"--simd={arguments.simd}"] if arguments.simd else [])
    facts = common.machine() | {key: context[key] for key in ("simd", "compiler", "flags")}
    common.heading(f"cost of a vertex, {VERTICES:,} vertices, one thread", facts)
    print(*table(found), sep="\n")
    print()
    draw("cost-of-influences", "influences a vertex, of 100 bones; mixed: 1 to 4, 1.85 in the mean",
         list(INFLUENCES), [1, 2, 3, 4, 6, 8, 9.5], [f"{i}/100" for i in INFLUENCES], found, False)
    draw("cost-of-bones", "bones, at 4 influences a vertex", list(BONES), list(BONES),
         [f"4/{bones}" for bones in BONES], found, True)
    common.write(arguments.name, machine=facts, nanoseconds=found)


if __name__ == "__main__":
    main()
