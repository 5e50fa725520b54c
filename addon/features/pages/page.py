# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a comparison: one HTML file that contains its pictures and needs no other file
(page.html)."""

import base64
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import SinewError
from ..measure.comparison import Comparison
from ..measure.diagnostics import Finding
from ..measure.heat_scale import HeatScale
from ..measure.suggestion import MEASURED, Suggestion
from .plots import colour_of, line_plot
from .templates import render

# Title, unit, and entries of the summaries. A plot has a line for each method and entry.
PLOTS = (
    ("Distance, largest", "length", ("distance_max",)),
    ("Volume change", "percent", ("volume_change",)),
    ("Area change", "percent", ("area_change",)),
    ("Edge stretch, RMS", "percent", ("stretch_rms",)),
    ("Edge stretch, largest and least", "times rest", ("stretch_max", "stretch_min")),
    ("Flipped faces", "", ("flipped_faces",)),
    ("Bulge, outwards and inwards", "length", ("bulge_max", "bulge_min")),
)


@dataclass(frozen=True)
class Row:
    """Pictures of each method in order, with a label beside them."""

    label: str
    pictures: Sequence[Path]


@dataclass(frozen=True)
class Sheet:
    """A heading, a sentence, rows of pictures, and a legend if they show a heat map."""

    title: str
    text: str
    rows: Sequence[Row]
    legend: HeatScale | None = None


def page(comparison: Comparison, sheets: Sequence[Sheet], note: str = "") -> str:
    """note: one sentence for the top of the page, about what was not possible."""
    plots, not_drawn = [], ""
    try:
        plots = _plots(comparison) if len(comparison.frames) > 1 else []
    except SinewError as error:
        not_drawn = str(error)
    return render(
        Path(__file__).with_name("page.html"),
        comparison=comparison,
        sheets=sheets,
        note=note,
        best=_suggestion(comparison).text if len(comparison.methods) > 1 else "",
        plots=plots,
        not_drawn=not_drawn,
        overview=lambda method: _overview(comparison, method),
        where=_where,
        colour_of=colour_of,
        legend_texts=legend_texts,
        ramp=_ramp,
        data=_data,
        percent=_percent,
        times=_times,
    )


def _suggestion(comparison: Comparison) -> Suggestion:
    suggestion = Suggestion(comparison.methods, comparison.frames, comparison.rest.diagonal)
    for method in comparison.methods:
        for name, entry in MEASURED.items():
            for frame, value in zip(comparison.frames, comparison.values(method, entry), strict=True):
                suggestion.add(method, name, value, frame)
    return suggestion


def _overview(comparison: Comparison, method: str) -> list[str]:
    diagonal = comparison.rest.diagonal or 1.0

    def values(entry: str) -> list[float]:
        return comparison.values(method, entry)

    def at(entry: str, text: Callable[[float], str]) -> str:
        worst = max(values(entry))
        return (
            f"{text(worst)} at {comparison.frames[values(entry).index(worst)]}"
            if comparison.shows(entry, worst)
            else "none"
        )

    taken, own = (statistics.median(times[method]) for times in (comparison.times, comparison.own))
    return [
        at(
            "distance_max",
            lambda value: f"{comparison.length(value)}, {100 * value / diagonal:.2g} % of diagonal",
        ),
        _percent_range(values("volume_change")),
        _percent_range(values("area_change")),
        f"{100 * max(values('stretch_rms')):.1f} %, {_times(max(values('stretch_max')))}, "
        f"{_times(min(values('stretch_min')))}",
        at("flipped_faces", lambda value: f"{value:,}"),
        f"{comparison.length(max(values('bulge_max')))}, {comparison.length(min(values('bulge_min')))}",
        f"{taken:.2f} ms" + (f", {own:.2f} ms" if own else ""),
    ]


def _where(finding: Finding) -> str:
    where = [f"Bone: {finding.bone}"] if finding.bone else []
    if finding.groups:
        where.append(f"Groups: {', '.join(finding.groups)}")
    if len(finding.vertices):
        first = ", ".join(map(str, finding.vertices[:12]))
        more = len(finding.vertices) - 12
        where.append(
            f"Vertices: {first}" + (f" and {more:,} more (metrics.json has all)" if more > 0 else "")
        )
    if finding.frames:
        where.append(f"Frames: {_frame_list(finding.frames)}")
    return f"{'. '.join(where)}."


def _plots(comparison: Comparison) -> list[str]:
    plots = []
    for title, unit, entries in PLOTS:
        factor = 100.0 if unit == "percent" else 1.0
        lines = {
            label: [[factor * value for value in comparison.values(method, entry)] for entry in entries]
            for method, label in comparison.methods.items()
        }
        shown = {"length": comparison.unit, "percent": "%"}.get(unit, unit)
        plots.append(line_plot(title, shown, comparison.frames, lines))
    return plots


def _ramp(scale: HeatScale) -> str:
    """The colours as stops of a gradient."""
    colours = np.round(255 * scale.ramp(np.linspace(0.0, 1.0, 17))).astype(int)
    return ", ".join(f"rgb({r},{g},{b})" for r, g, b in colours)


def legend_texts(scale: HeatScale, unit: str) -> list[str]:
    """The legend's numbers with their unit, from low to high."""
    if scale.metric.unit == "length":
        texts = [f"{value:.3g} {unit}" for value in scale.ticks()]
    elif scale.metric.unit == "share":
        texts = [f"{100 * value:.0f} %" for value in scale.ticks()]
    else:
        texts = [_times(value) for value in scale.ticks()]
    if scale.clipped:
        texts[-1] += " and more"
        if scale.metric.scale != "linear":
            texts[0] += " and less"
    return texts


def _times(value: float) -> str:
    return f"{value:.3g}x"


def _percent(value: float) -> str:
    return "undefined" if value != value else f"{100 * value:+.1f} %"


def _percent_range(values: Sequence[float]) -> str:
    known = [value for value in values if value == value]
    return f"{_percent(min(known))}, {_percent(max(known))}" if known else "undefined"


def _frame_list(frames: Sequence[float]) -> str:
    """Such as "3, 7 to 12, 20"."""
    runs: list[list[float]] = []
    for frame in frames:
        if runs and frame == runs[-1][-1] + 1:
            runs[-1][1:] = [frame]
        else:
            runs.append([frame])
    return ", ".join(" to ".join(map(str, run)) for run in runs)


def _data(path: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")
