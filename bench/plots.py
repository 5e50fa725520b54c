# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots the time per vertex by influences and by bones: two plots in docs/, a table and JSON."""

from __future__ import annotations

from pathlib import Path

import common
import kernels
import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

DOCS = Path(__file__).resolve().parents[1] / "docs"
# In the order of the methods (P. Tol's bright scheme, which is safe for colour-blind readers).
COLOURS = ("#4477aa", "#ccbb44", "#ee6677", "#228833", "#66ccee", "#aa3377", "#bbbbbb")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
INFLUENCES = ("1", "2", "3", "4", "6", "8", "mixed")
BONES = (10, 30, 100, 300, 1000)
VERTICES = 100_000
# The usual name of Highway's AVX3.
SETS = {"AVX3": "AVX-512"}


def pairs() -> list[tuple[str, int]]:
    others = [("4", bones) for bones in BONES if bones != 100]
    return [(influences, 100) for influences in INFLUENCES] + others


def costs(program: Path, simd: str | None) -> tuple[dict, dict]:
    """({context}, {"method/influences/bones": nanoseconds per vertex}), the minimum of many runs."""
    context, found = {}, {}
    options = [f"--simd={simd}"] if simd else []
    for influences, bones in pairs():
        context, times = kernels.run(program, f"^cost/[a-z]*/{influences}/{bones}/", 100, options)
        for name, spread in times.items():
            found[name.removeprefix("cost/")] = spread["least"] / VERTICES
    return context, found


def methods_of(found: dict) -> list[str]:
    """The methods that the program measured, in its order, which is that of the library's list."""
    return list(dict.fromkeys(name.split("/")[0] for costs_of in found.values() for name in costs_of))


def draw(name: str, label: str, ticks: tuple, positions: tuple, keys: list[str], found: dict) -> None:
    """A panel for each instruction set, on a common scale."""
    figure, panels = plt.subplots(
        1, len(found), figsize=(4.2 * len(found), 3.4), layout="constrained", sharey=True, squeeze=False
    )
    for axes, (simd, costs_of) in zip(panels[0], found.items(), strict=True):
        for number, method in enumerate(methods_of(found)):
            values = [costs_of[f"{method}/{key}"] for key in keys]
            joined = [i for i, tick in enumerate(ticks) if tick != "mixed"]
            style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}
            axes.plot([positions[i] for i in joined], [values[i] for i in joined], label=method, **style)
            for i in set(range(len(ticks))) - set(joined):
                axes.plot(positions[i], values[i], linestyle="none", **style)
        if positions is BONES:
            axes.set_xscale("log")
            axes.minorticks_off()
        axes.set_xticks(positions, [f"{tick:,}" if tick in BONES else tick for tick in ticks])
        axes.set_xlabel(label)
        axes.set_title(SETS.get(simd, simd), fontsize="medium")
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0][0].set_ylim(bottom=0)
    panels[0][0].set_ylabel("nanoseconds a vertex")
    panels[0][0].legend(frameon=False, loc="lower right")
    path = DOCS / f"{name}.svg"
    # Without a date, so that the same figures give the same file.
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
    print(path)


def table(found: dict) -> list[str]:
    methods = methods_of(found)
    sets = [f"{method}, {SETS.get(simd, simd)}" for simd in found for method in methods]
    head = ["influences", "bones", *sets]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for influences, bones in pairs():
        cells = [influences, f"{bones:,}"]
        for costs_of in found.values():
            cells += [f"{costs_of[f'{method}/{influences}/{bones}']:.2f}" for method in methods]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def main() -> None:
    parser = common.options(__doc__, "costs")
    parser.add_argument("program", type=Path)
    arguments = parser.parse_args()
    plt.rcParams["svg.hashsalt"] = "sinew"
    context, best = costs(arguments.program, None)
    found = {context["simd"]: best}
    if context["simd"] == "AVX3":
        found["AVX2"] = costs(arguments.program, "AVX2")[1]
    title = f"nanoseconds a vertex, {VERTICES:,} vertices, one thread"
    facts = common.begin(title, compiler=context["compiler"], flags=context["flags"])
    print(*table(found), sep="\n")
    print()
    draw(
        "cost-of-influences",
        "influences a vertex, of 100 bones",
        INFLUENCES,
        (1, 2, 3, 4, 6, 8, 9.5),
        [f"{influences}/100" for influences in INFLUENCES],
        found,
    )
    draw("cost-of-bones", "bones, at 4 influences a vertex", BONES, BONES, [f"4/{b}" for b in BONES], found)
    common.write(arguments.name, machine=facts, nanoseconds=found)


if __name__ == "__main__":
    main()
