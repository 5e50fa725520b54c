# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a comparison: one HTML file that contains its pictures and needs no other file."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from .comparison import Comparison
from .diagnostics import Finding
from .errors import SinewError
from .heat import HeatScale
from .plots import colour_of, line_plot
from .suggestion import CRITERIA, Suggestion

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
    title = f"{comparison.file}: {', '.join(comparison.meshes)}"
    body = [
        f"<h1>{escape(comparison.file)}</h1>",
        f'<p class="faint">{_about(comparison)}</p>',
        f'<p class="note">{escape(note)}</p>' if note else "",
        _overview(comparison),
        _diagnostics(comparison),
        _plots(comparison) if len(comparison.frames) > 1 else "",
        *(_sheet(sheet, comparison) for sheet in sheets),
        _numbers(comparison),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(part for part in body if part)
        + "\n</body>\n</html>\n"
    )


def _about(comparison: Comparison) -> str:
    rest, frames = comparison.rest, comparison.frames
    span = f"frame {frames[0]}" if len(frames) == 1 else f"{len(frames)} frames, {frames[0]} to {frames[-1]}"
    lengths = "metres" if comparison.unit == "m" else "Blender's units"
    return (
        f"{escape(', '.join(comparison.meshes))}: {rest.vertices:,} vertices, {rest.triangles:,} triangles, "
        f"diagonal {comparison.length(rest.diagonal)}, {span}. Lengths are in {lengths}; shapes are "
        "measured as the skinning leaves them, before the modifiers behind it. Distances are "
        f"measured to: {escape(_method(comparison, comparison.reference))}. {escape(rest.note)}"
    )


def _overview(comparison: Comparison) -> str:
    columns = (
        ("Method", ""),
        ("Distance", "largest, at frame"),
        ("Volume", "least and most, against rest"),
        ("Area", "least and most, against rest"),
        ("Edge stretch", "RMS, longest, shortest"),
        ("Flipped faces", "most, at frame"),
        ("Bulge", "farthest out, farthest in"),
        ("Time a frame", "Blender's whole frame, of it Sinew"),
    )
    head = "".join(f'<th>{name}<br><span class="faint">{hint}</span></th>' for name, hint in columns)
    rows = [
        (f"{_key(number)}{escape(label)} {_faint(method)}", *_overview_cells(comparison, method))
        for number, (method, label) in enumerate(comparison.methods.items())
    ]
    best = "" if len(rows) < 2 else f"<p>{escape(_suggestion(comparison).text)}</p>"
    return f'<div class="wide"><table><tr>{head}</tr>{_table_rows(rows)}</table></div>{best}'


def _suggestion(comparison: Comparison) -> Suggestion:
    suggestion = Suggestion(comparison.methods, comparison.frames, comparison.rest.diagonal)
    for method in comparison.methods:
        for criterion in CRITERIA:
            if criterion.entry:
                values = comparison.values(method, criterion.entry)
                for frame, value in zip(comparison.frames, values, strict=True):
                    suggestion.add(method, criterion.name, value, frame)
    return suggestion


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


def _diagnostics(comparison: Comparison) -> str:
    blocks = []
    for mesh, findings in comparison.findings.items():
        title = f"<h3>{escape(mesh)}</h3>" if len(comparison.findings) > 1 else ""
        text = "".join(_finding(finding) for finding in findings) or "<p>Nothing found.</p>"
        blocks.append(title + text)
    return f"<h2>Diagnostics</h2>{''.join(blocks)}"


def _finding(finding: Finding) -> str:
    where = []
    if finding.groups:
        where.append("Groups: " + escape(", ".join(finding.groups)))
    if len(finding.vertices):
        first = ", ".join(map(str, finding.vertices[:12]))
        more = len(finding.vertices) - 12
        where.append(
            f"Vertices: {first}" + (f" and {more:,} more (metrics.json has all)" if more > 0 else "")
        )
    if finding.frames:
        where.append(f"Frames: {_frame_list(finding.frames)}")
    return (
        f'<div class="finding"><b>{escape(finding.title)}: {finding.count:,}</b>'
        f"<p>{escape(finding.meaning)} <i>{escape(finding.advice)}</i></p>"
        f'<p class="faint">{". ".join(where)}.</p></div>'
    )


def _plots(comparison: Comparison) -> str:
    plots = []
    for title, unit, entries in PLOTS:
        factor = 100.0 if unit == "percent" else 1.0
        lines = {
            label: [[factor * value for value in comparison.values(method, entry)] for entry in entries]
            for method, label in comparison.methods.items()
        }
        shown = {"length": comparison.unit, "percent": "%"}.get(unit, unit)
        try:
            plots.append(f'<div class="plot">{line_plot(title, shown, comparison.frames, lines)}</div>')
        except SinewError as error:
            return f'<h2>Over the frames</h2><p class="note">Not drawn: {escape(str(error))}.</p>'
    keys = "".join(
        f"<span>{_key(number)}{escape(label)}</span>"
        for number, label in enumerate(comparison.methods.values())
    )
    return f'<h2>Over the frames</h2><p class="keys">{keys}</p><div class="plots">{"".join(plots)}</div>'


def _sheet(sheet: Sheet, comparison: Comparison) -> str:
    head = "<th></th>" + "".join(
        f"<th>{escape(label)} {_faint(method)}</th>" for method, label in comparison.methods.items()
    )
    rows = []
    for row in sheet.rows:
        cells = "".join(
            f'<td><img alt="{escape(path.stem)}" src="{_data(path)}"></td>' for path in row.pictures
        )
        rows.append(f"<tr><th>{escape(row.label)}</th>{cells}</tr>")
    legend = _legend(sheet.legend, comparison.unit) if sheet.legend is not None else ""
    return (
        f"<h2>{escape(sheet.title)}</h2><p>{escape(sheet.text)}</p>{legend}"
        f'<div class="wide"><table class="sheet"><tr>{head}</tr>{"".join(rows)}</table></div>'
    )


def _legend(scale: HeatScale, unit: str) -> str:
    stops = ", ".join(
        f"rgb({round(255 * r)},{round(255 * g)},{round(255 * b)})"
        for r, g, b in scale.ramp(np.linspace(0.0, 1.0, 17))
    )
    texts = legend_texts(scale, unit)
    ticks = []
    for number, text in enumerate(texts):
        position = 100 * number / (len(texts) - 1)
        # Centred below its colour; the first and the last are aligned with the ends.
        offset = {0: 0, len(texts) - 1: 100}.get(number, 50)
        ticks.append(f'<span style="left:{position}%;transform:translateX(-{offset}%)">{escape(text)}</span>')
    return (
        f'<div class="legend"><div class="ramp" style="background:linear-gradient(to right, {stops})"></div>'
        f'<div class="ticks">{"".join(ticks)}</div></div>'
    )


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


def _numbers(comparison: Comparison) -> str:
    entries = [
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
        (str(frame), escape(label), *(text(comparison.summaries[method][index]) for _name, text in entries))
        for index, frame in enumerate(comparison.frames)
        for method, label in comparison.methods.items()
    ]
    head = "".join(f"<th>{escape(name)}</th>" for name in ("Frame", "Method", *(name for name, _ in entries)))
    return (
        "<h2>All frames</h2><details><summary>Numbers of every frame</summary>"
        f'<div class="wide"><table><tr>{head}</tr>{_table_rows(rows)}</table></div></details>'
    )


def _table_rows(rows: Sequence[Sequence[str]]) -> str:
    return "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)


def _key(number: int) -> str:
    return f'<span class="key" style="background:{colour_of(number)}"></span>'


def _faint(text: str) -> str:
    return f'<span class="faint">{escape(text)}</span>'


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


_STYLE = """
:root { color-scheme: light dark; --text: #1d1f23; --faint: #676c74; --line: #d5d8dd; --back: #fff;
  --cell: #3a3d42; --warn: #8a5a00; }
@media (prefers-color-scheme: dark) { :root { --text: #e8e8e8; --faint: #a0a4aa; --line: #43474e;
  --back: #1b1d20; --warn: #e3b341; } }
body { font: 14px/1.45 system-ui, sans-serif; color: var(--text); background: var(--back);
  margin: 24px auto; max-width: 1500px; padding: 0 24px; }
h1 { font-size: 24px; margin: 0 0 4px; } h2 { font-size: 18px; margin: 32px 0 8px; }
p { margin: 4px 0 10px; max-width: 100ch; } .faint { color: var(--faint); font-weight: normal; }
.note { color: var(--warn); } .wide { overflow-x: auto; }
table { border-collapse: collapse; } td, th { padding: 4px 12px 4px 0; text-align: left;
  vertical-align: top; border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; }
.sheet td, .sheet th { border: 0; padding: 4px 8px 4px 0; }
.sheet tr > th:first-child { min-width: 5em; max-width: 9em; }
.sheet img { display: block; max-width: 100%; min-width: 160px; background: var(--cell); border-radius: 6px; }
.key { display: inline-block; width: 14px; height: 10px; border-radius: 2px; margin-right: 6px; }
.keys > span { margin-right: 20px; } .finding { margin: 10px 0; padding-left: 12px;
  border-left: 3px solid var(--warn); } .finding p { margin: 2px 0; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(380px, 1fr)); gap: 12px; }
.plot svg { width: 100%; height: auto; }
.legend { max-width: 560px; margin: 6px 0 10px; } .ramp { height: 14px; border-radius: 3px; }
.ticks { position: relative; height: 18px; font-size: 12px; }
.ticks span { position: absolute; white-space: nowrap; }
"""
