# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a comparison: one HTML file that holds its pictures and needs nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .comparison import Comparison
from .diagnostics import Finding
from .heat import HeatScale, viridis
from .html_templates import render
from .metrics import Summary
from .plots import colour_of, line_plot

# Title, unit and entries of the summaries: a line for each method and entry.
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
    """A heading, a sentence, rows of pictures, and the legend where they show a heat map."""

    title: str
    text: str
    rows: Sequence[Row]
    legend: HeatScale | None = None


OVERVIEW_COLUMNS = (
    ("Method", ""),
    ("Distance", "largest, at frame"),
    ("Volume", "least and most, against rest"),
    ("Area", "least and most, against rest"),
    ("Edge stretch", "RMS, longest, shortest"),
    ("Flipped faces", "most, at frame"),
    ("Bulge", "farthest out, farthest in"),
    ("Time a frame", "Blender's whole frame, of it Sinew"),
)


def page(comparison: Comparison, sheets: Sequence[Sheet], note: str = "") -> str:
    """note  one sentence for the top: what was not possible

    Raises SinewError where Jinja2 is missing.
    """
    number_columns, number_rows = _numbers(comparison)
    return render(
        "comparison.html",
        title=f"{comparison.file}: {', '.join(comparison.meshes)}",
        comparison=comparison,
        about=_about(comparison),
        note=note,
        methods=_methods(comparison),
        overview_columns=OVERVIEW_COLUMNS,
        diagnostics={
            mesh: [(finding, _where(finding)) for finding in findings]
            for mesh, findings in comparison.findings.items()
        },
        plots=_plots(comparison) if len(comparison.frames) > 1 else (),
        sheets=[_sheet(sheet, comparison.unit) for sheet in sheets],
        number_columns=number_columns,
        number_rows=number_rows,
    )


def _about(comparison: Comparison) -> str:
    rest, frames = comparison.rest, comparison.frames
    span = f"frame {frames[0]}" if len(frames) == 1 else f"{len(frames)} frames, {frames[0]} to {frames[-1]}"
    lengths = "metres" if comparison.unit == "m" else "Blender's units"
    return (
        f"{', '.join(comparison.meshes)}: {rest.vertices:,} vertices, {rest.triangles:,} triangles, "
        f"diagonal {comparison.length(rest.diagonal)}, {span}. Lengths are in {lengths}; shapes are "
        "measured as the skinning leaves them, before the modifiers behind it. Distances are "
        f"measured to: {_method(comparison, comparison.reference)}. {rest.note}"
    )


def _methods(comparison: Comparison) -> list[dict[str, object]]:
    return [
        {
            "name": method,
            "label": label,
            "colour": colour_of(number),
            "overview": _overview_cells(comparison, method),
        }
        for number, (method, label) in enumerate(comparison.methods.items())
    ]


def _overview_cells(comparison: Comparison, method: str) -> list[str]:
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

    own = comparison.median_own_time(method)
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
        f"{comparison.median_time(method):.2f} ms" + (f", {own:.2f} ms" if own else ""),
    ]


def _where(finding: Finding) -> list[str]:
    """Groups, vertices and frames of a finding, one text for each that it has."""
    where = []
    if finding.groups:
        where.append("Groups: " + ", ".join(finding.groups))
    if len(finding.vertices):
        first = ", ".join(map(str, finding.vertices[:12]))
        more = len(finding.vertices) - 12
        where.append(
            f"Vertices: {first}" + (f" and {more:,} more (metrics.json has all)" if more > 0 else "")
        )
    if finding.frames:
        where.append(f"Frames: {_frame_list(finding.frames)}")
    return where


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


def _sheet(sheet: Sheet, unit: str) -> dict[str, object]:
    legend = None if sheet.legend is None else _legend(sheet.legend, unit)
    return {"title": sheet.title, "text": sheet.text, "rows": sheet.rows, "legend": legend}


def _legend(scale: HeatScale, unit: str) -> dict[str, object]:
    texts = legend_texts(scale, unit)
    last = len(texts) - 1
    return {
        "stops": [
            f"rgb({round(255 * r)},{round(255 * g)},{round(255 * b)})"
            for r, g, b in viridis(np.linspace(0.0, 1.0, 17))
        ],
        # Each is centred below its colour, except those at the ends.
        "ticks": [
            {"percent": 100 * number / last, "shift": {0: 0, last: 100}.get(number, 50), "text": text}
            for number, text in enumerate(texts)
        ],
    }


def legend_texts(scale: HeatScale, unit: str) -> list[str]:
    """The legend's numbers with their unit, from the low end to the high one."""
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


def _numbers(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table of all frames."""
    entries: list[tuple[str, Callable[[Summary], str]]] = [
        ("Distance, largest", lambda s: comparison.length(s.distance_max)),
        ("RMS", lambda s: comparison.length(s.distance_rms)),
        ("Volume", lambda s: _percent(s.volume_change)),
        ("Area", lambda s: _percent(s.area_change)),
        ("Stretch, RMS", lambda s: f"{100 * s.stretch_rms:.1f} %"),
        ("longest", lambda s: _times(s.stretch_max)),
        ("shortest", lambda s: _times(s.stretch_min)),
        ("Flipped", lambda s: f"{s.flipped_faces:,}"),
        ("Bulge out", lambda s: comparison.length(s.bulge_max)),
        ("in", lambda s: comparison.length(s.bulge_min)),
    ]
    rows = [
        [str(frame), label, *(text(comparison.summaries[method][index]) for _name, text in entries)]
        for index, frame in enumerate(comparison.frames)
        for method, label in comparison.methods.items()
    ]
    return ["Frame", "Method", *(name for name, _text in entries)], rows


def _method(comparison: Comparison, method: str) -> str:
    return comparison.methods.get(method, "Armature modifier" if method == "blender" else method)


def _times(value: float) -> str:
    return f"{value:.3g}x"


def _percent(value: float) -> str:
    return "undefined" if value != value else f"{100 * value:+.1f} %"


def _percent_range(values: Sequence[float]) -> str:
    known = [value for value in values if value == value]
    return f"{_percent(min(known))}, {_percent(max(known))}" if known else "undefined"


def _frame_list(frames: Sequence[float]) -> str:
    """Frames as "3, 7 to 12, 20"."""
    runs: list[list[float]] = []
    for frame in frames:
        if runs and frame == runs[-1][-1] + 1:
            runs[-1][1:] = [frame]
        else:
            runs.append([frame])
    return ", ".join(" to ".join(map(str, run)) for run in runs)
