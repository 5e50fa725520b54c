# SPDX-License-Identifier: GPL-3.0-or-later
"""The five best results as a short page with plots, made from report.json: no number is typed here."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sinew_addon.base.errors import SinewError
from sinew_addon.base.output import write_text
from sinew_addon.features.pages.plots import COLOURS, new_figure, to_svg

NAMES = {"affine": "matrices", "quat_vec": "pairs", "dual_quat": "dual quaternions"}
_COLOUR = dict(zip(NAMES, COLOURS, strict=False))
_OF_SKINNING = {"lbs": "affine", "qv": "quat_vec", "dq": "dual_quat", "log": "affine", "sbs": "quat_vec"}
TIMES = {"3.4": "Combine two", "3.5": "Move a point", "3.10": "Blend three and move a point"}
_SHORT = {
    "lbs": "linear matrices",
    "log": "logarithms",
    "sbs": "spherical blending",
    "qv": "pairs",
    "dq": "dual quaternions",
}
# The parts that the page needs, besides `studies`.
_TABLES, _FIGURES = (*TIMES, "3.7", "3.9"), ("3.4", "3.10", "3.11")

Content = Mapping[str, Any]


def digest(report: Content) -> dict[str, Any]:
    """Returns what the page needs from report.json: facts, the rows of Table 3.7, studies, and how it was
    made.

    Raises SinewError where any of it was not measured or drawn.
    """
    if report.get("quick"):
        raise SinewError("its times are of quick mode and say nothing: make it without --quick")
    missing = [f"Table {number}" for number in _TABLES if report["tables"][number]["missing"]]
    missing += [f"Figure {number}" for number in _FIGURES if report["figures"][number]["missing"]]
    if missing:
        raise SinewError(f"the results need what is missing in it: {', '.join(missing)}")
    return {
        "version": report["version"],
        "machine": report["machine"],
        "tables": {number: {"facts": report["tables"][number]["facts"]} for number in _TABLES}
        | {"3.7": {key: report["tables"]["3.7"][key] for key in ("facts", "rows")}},
        "figures": {number: {"facts": report["figures"][number]["facts"]} for number in _FIGURES},
        "studies": report["studies"],
    }


def read(path: Path) -> dict[str, Any]:
    """Returns digest() of a report.json. Raises SinewError that names the file."""
    try:
        return digest(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError) as error:
        raise SinewError(f"{path}: no report.json of ./dev report: {error}") from None
    except SinewError as error:
        raise SinewError(f"{path}: {error}") from None


def write(content: Content, folder: Path) -> list[Path]:
    """Writes results.md, its plots and results.json, from which they are made, to `folder`."""
    files = {"results.md": page(content), **plots(content)}
    files["results.json"] = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    for name, text in files.items():
        write_text(folder / name, text)
    return [folder / name for name in files]


# --- Numbers


def _values(content: Content, part: str, number: str) -> dict[str, float]:
    """Returns the values of all facts of a table or figure."""
    found: dict[str, float] = {}
    for fact in content[part][number]["facts"]:
        found |= fact["values"]
    return found


def _orders(content: Content, number: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Returns the facts about a table's order: unoptimised, and optimised with the fastest of each."""
    first, second = content["tables"][number]["facts"][:2]
    return first, second


def _lengths(content: Content, study: str) -> dict[int, dict[str, dict[str, float]]]:
    return {
        int(name.split(", ")[1]): spreads
        for name, spreads in content["studies"].items()
        if name.startswith(f"{study}, ")
    }


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


# --- The page


def page(content: Content) -> str:
    """Returns results.md."""
    machine = content["machine"]
    return (
        "\n\n".join(
            [
                "# Five results",
                "<!-- Made by ./dev report --results; edit experiments/smith_2013/paper.py. -->",
                "M. Smith, *Applications of Dual Quaternions in Three Dimensional Transformation and "
                "Interpolation* (University of Canterbury, 2013), asks which representation of rigid "
                "transforms suits animation best: matrices, pairs of a quaternion and a vector, or dual "
                "quaternions. We repeated its experiments. This page has the five results that change or "
                "settle an answer. "
                "[The report](report.md) has all results, and where each is in the library.",
                _order_section(content),
                _accuracy_section(content),
                _drift_section(content),
                _shape_section(content),
                _axes_section(content),
                "## How it was done",
                f"Sinew {content['version']}, {machine['processor']}, {machine.get('compiler', 'unknown')}, "
                f"{machine.get('optimised', '')} and {machine.get('without optimisation', '')}; load average "
                f"{machine.get('load average', 'unknown')}. Times are processor times, medians of "
                "interleaved runs. Random chains have fixed seeds. Every number on this page comes from "
                "[the measurements](results.json), none is typed by hand: `./dev report --results docs` "
                "measures, and writes this page and its plots.",
                "To cite this page, use CITATION.cff of the repository and the version above.",
            ]
        )
        + "\n"
    )


def _order_section(content: Content) -> str:
    held = {number: _orders(content, number) for number in TIMES}
    unoptimised = [number for number, (first, _second) in held.items() if first["agrees"]]
    optimised = [number for number, (_first, second) in held.items() if second["agrees"]]
    count = len(TIMES)
    found = (
        f"We find the printed order of the three in {len(unoptimised)} of {count} tables if GLM is built "
        f"without optimisation, and in {len(optimised)} of {count} with the best optimised implementation "
        "of each."
    )
    if len(optimised) < len(unoptimised):
        title = "The order of the times is that of a build without optimisation"
    elif len(optimised) == count:
        title = "The order of the times holds for the best implementations, too"
    else:
        title = "The order of the times depends on the implementation"
    sentences = []
    for number, (_first, second) in held.items():
        _how, times = second["ours"].split(": ", 1)
        sentences.append(f"{TIMES[number]} (Table {number}): {times}")
    ratios = [
        fact["values"]["ratio"] for fact in content["tables"]["3.9"]["facts"] if "ratio" in fact["values"]
    ]
    return "\n\n".join(
        [
            f"## 1. {title}",
            "In all three tables of the report, matrices are the slowest. It asks for better "
            f"implementations of them. {found} The times of the best of each are, plus or minus half the "
            "interquartile range of the runs:",
            "\n".join(f"- {sentence}" for sentence in sentences),
            f"The fastest ScLERP takes {ratios[0]:.1f} times as long as the fastest DLB without optimisation "
            f"and {ratios[1]:.1f} times with it; the report says almost twice.",
            "![Times by representation, without optimisation and with it](results-times.svg)",
        ]
    )


def _accuracy_section(content: Content) -> str:
    of_lengths = _lengths(content, "accuracy")
    first, last = min(of_lengths), max(of_lengths)
    orders = {
        length: [name for _rms, name in sorted((spread["rms"], name) for name, spread in spreads.items())]
        for length, spreads in of_lengths.items()
    }
    leaders = {orders[length][0] for length in of_lengths}
    title = (
        f"{NAMES[leaders.pop()].capitalize()} are the most accurate"
        if len(leaders) == 1
        else "Which is the most accurate depends on the length of the chain"
    )
    ranks = []
    for length, order in orders.items():
        listed = [f"{NAMES[name]} {of_lengths[length][name]['rms']:.1e}" for name in order]
        ranks.append(f"at {length} links {_listed(listed)}")
    pairs_first = [
        str(length) for length, of in of_lengths.items() if of["quat_vec"]["rms"] < of["dual_quat"]["rms"]
    ]
    claim = (
        "Pairs are more accurate than dual quaternions in none of these lengths."
        if not pairs_first
        else f"Pairs are more accurate than dual quaternions with {_listed(pairs_first)} links"
        + ("." if len(pairs_first) == len(of_lengths) else ", and less accurate with the others.")
    )
    return "\n\n".join(
        [
            f"## 2. {title}",
            "The report finds pairs more accurate than dual quaternions, from one chain of four links. We "
            f"measured random chains of {first} to {last} links in float32, without normalising on the way. "
            "These are the errors of the end, relative to the length (root mean square, the most accurate "
            f"first): {'; '.join(ranks)}. {claim}",
            "![Error by length of the chain](results-accuracy.svg)",
        ]
    )


def _drift_section(content: Content) -> str:
    of_lengths = {length: of["dlb"] for length, of in _lengths(content, "drift").items()}
    first, last = min(of_lengths), max(of_lengths)
    grows = of_lengths[last]["rms"] / of_lengths[first]["rms"]
    found = ", ".join(f"{length} links {of['rms']:.2%}" for length, of in of_lengths.items())
    if grows > 1.5:
        title, claim = "DLB's error adds up in long chains", f"it grows {grows:.1f} times"
    elif grows < 1 / 1.5:
        title, claim = "DLB's error evens out in long chains", f"it shrinks to {grows:.2f} times"
    else:
        title, claim = "DLB's error does not add up", f"it stays within {max(grows, 1 / grows):.1f} times"
    return "\n\n".join(
        [
            f"## 3. {title}",
            "The report asks whether the difference between DLB and ScLERP adds up in a chain. We measured "
            "random chains whose joints rotate by up to 90 degrees between two keys. These are the distances "
            f"of their tips, relative to the length (root mean square): {found}. From {first} to {last} "
            f"links {claim}.",
            "![How far DLB is from ScLERP, by length of the chain](results-drift.svg)",
        ]
    )


def _radii(content: Content) -> dict[str, float]:
    values = _values(content, "figures", "3.11")
    return {
        name.removeprefix("radius, "): share for name, share in values.items() if name.startswith("radius, ")
    }


def _shape_section(content: Content) -> str:
    radii = _radii(content)
    kept = [_SHORT.get(name, name) for name, share in radii.items() if share > 0.95]
    lost = [f"{_SHORT.get(name, name)} {share:.0%}" for name, share in radii.items() if share <= 0.95]
    bends = _values(content, "figures", "3.4")
    drift = _values(content, "figures", "3.10")["drift, in widths"]
    title = "What blends of joints keep"
    if {"pairs", "dual quaternions"} <= set(kept) and drift > 0.25:
        title = "Pairs keep the shape of a joint and lose its place; dual quaternions keep both"
    text = (
        f"A joint twisted by 170 degrees (Figure 3.11) keeps its radius, to 5 %, with {_listed(kept)}"
        if kept
        else "A joint twisted by 170 degrees (Figure 3.11) keeps its radius with none of them"
    )
    if lost:
        text += f"; the others keep less: {_listed(lost)}"
    return "\n\n".join(
        [
            f"## 4. {title}",
            f"{text}. With pairs, a bent joint three links from the origin (Figure 3.10) is up to "
            f"{drift:.1f} widths of the limb away from where dual quaternions put it. Between two transforms "
            "(Figure 3.4) the path of the origin leaves the straight line by "
            f"{bends['sclerp']:.2f} with ScLERP, {bends['dlb']:.2f} with DLB and {bends['qv_slerp']:.0e} "
            "with pairs by slerp, which rotate about the origin, wherever that is.",
            "![Radius that a twisted joint keeps](results-radius.svg)",
        ]
    )


def _axes_section(content: Content) -> str:
    rows = content["tables"]["3.7"]["rows"]
    off = max(row["more"]["difference from unit axes"] for row in rows)
    built = max(row["more"]["difference"] for row in rows)
    values = _values(content, "tables", "3.7")
    apart = max(values.values())
    found = (
        "The representation is not the cause"
        if apart < 0.1 * off
        else "The rounding of the axes is not the only cause"
    )
    return "\n\n".join(
        [
            "## 5. Why the report's columns differ",
            "In Table 3.7 the same four transforms move a point in three representations, and "
            f"the point ends at different positions. {found}: with unit axes for all, matrices and dual "
            f"quaternions are at most {apart:.0e} apart in float32. But the printed axes are rounded, and "
            "matrices normalise the axis, while quaternions normalise the whole. Built in these two ways in "
            f"float64, every printed coordinate agrees to {built:.0e}; with unit axes they differ by up to "
            f"{off:.0e}.",
        ]
    )


# --- Plots


def plots(content: Content) -> dict[str, str]:
    """Returns SVG text by file name, on white, as the text would be invisible on a dark page.

    Raises SinewError without matplotlib.
    """
    drawn = {
        "results-times.svg": _plot_times(content),
        "results-accuracy.svg": _plot_lengths(
            "Error of float32", "error, of the length", _lengths(content, "accuracy"), NAMES
        ),
        "results-drift.svg": _plot_lengths(
            "DLB against ScLERP", "apart, of the length", _lengths(content, "drift"), {"dlb": "DLB"}
        ),
        "results-radius.svg": _plot_radius(content),
    }
    white = '<rect width="100%" height="100%" fill="#ffffff"/>'
    return {name: re.sub(r"(<svg[^>]*>)", rf"\1{white}", text, count=1) for name, text in drawn.items()}


def _plot_times(content: Content) -> str:
    most = max(
        value for number in TIMES for fact in _orders(content, number) for value in fact["values"].values()
    )
    with new_figure("Times", (7.6, 2.9), _SETTINGS) as figure:
        for column, number in enumerate(TIMES):
            axes = figure.add_subplot(1, len(TIMES), column + 1)
            for group, fact in enumerate(_orders(content, number)):
                for place, (row, value) in enumerate(fact["values"].items()):
                    axes.bar(group * 4 + place, value, color=_COLOUR[_OF_SKINNING.get(row, row)], width=0.9)
            axes.set_yscale("log")
            # The same scale for all, so that bars can be compared.
            axes.set_ylim(1.0, 10.0 ** math.ceil(math.log10(most)))
            axes.set_xticks([1, 5], ["not optimised", "optimised"])
            axes.set_title(TIMES[number].replace(" and ", ",\n"), fontsize="medium")
            if column == 0:
                axes.set_ylabel("nanoseconds")
        figure.legend(
            handles=_patches(_COLOUR), labels=list(NAMES.values()), loc="outside lower center", ncols=3
        )
        return to_svg(figure)


def _patches(colours: Mapping[str, str]) -> list[Any]:
    from matplotlib.patches import Patch

    return [Patch(color=colour) for colour in colours.values()]


_SETTINGS = {"axes.spines.top": False, "axes.spines.right": False}


def _plot_lengths(
    title: str, unit: str, of: dict[int, dict[str, dict[str, float]]], names: Mapping[str, str]
) -> str:
    """Plots root mean squares with the 5th and 95th percentiles."""
    lengths = sorted(of)
    with new_figure(title, (5.2, 2.8), _SETTINGS) as figure:
        axes = figure.add_subplot()
        for number, (key, name) in enumerate(names.items()):
            spreads = [of[length][key] for length in lengths]
            axes.fill_between(
                lengths,
                [one["low"] for one in spreads],
                [one["high"] for one in spreads],
                color=COLOURS[number],
                alpha=0.15,
                linewidth=0,
            )
            axes.plot(lengths, [one["rms"] for one in spreads], marker="o", color=COLOURS[number], label=name)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xticks(lengths, [str(length) for length in lengths])
        axes.minorticks_off()
        axes.set_xlabel("links; bands: 5 to 95 of 100 chains")
        axes.set_ylabel(unit)
        axes.legend(frameon=False)
        return to_svg(figure)


def _plot_radius(content: Content) -> str:
    radii = _radii(content)
    with new_figure("Radius", (5.4, 2.2), _SETTINGS) as figure:
        axes = figure.add_subplot()
        names = [_SHORT.get(name, name) for name in radii]
        axes.barh(names, [100 * share for share in radii.values()], color=COLOURS[0])
        axes.invert_yaxis()
        axes.set_xlabel("% of its radius that a twisted joint keeps")
        return to_svg(figure)
