# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes one HTML page that needs no other file, and the same as JSON."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path

from sinew_addon.base.output import write_text

from .model import Answer, Fact, Figure, Page, Picture, Row, Table

TITLE = "Dual quaternions in transformation and interpolation: the report's experiments, done again"

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1b1d21; background: #fff; margin: 0 auto;
  padding: 2em 1.5em; max-width: 84em; }
h1 { font-size: 1.7em; line-height: 1.25; } h2 { margin-top: 2.2em; border-bottom: 1px solid #c8ccd2; }
h3 { margin: 2em 0 .4em; font-size: 1.1em; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .84em; margin: .5em 0; }
th, td { padding: .25em .6em; text-align: left; vertical-align: top; border-bottom: 1px solid #e3e6ea; }
th { border-bottom: 1px solid #888d95; font-weight: 600; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.name { white-space: nowrap; }
td.why { min-width: 20em; color: #40454d; }
.yes { color: #1a7f37; font-weight: 600; } .no { color: #b35900; font-weight: 600; }
.faint { color: #5b616a; font-size: .9em; margin: .3em 0; } .missing { color: #b35900; }
.pictures { display: grid; gap: .8em; }
figure { margin: 0; } figcaption { font-size: .85em; color: #40454d; }
figure svg { width: 100%; height: auto; } figure img { display: block; max-width: 100%; }
dt { font-weight: 600; margin-top: .8em; } dd { margin-left: 0; }
"""


def write(page: Page, folder: Path) -> tuple[Path, Path]:
    """Writes report.html and report.json to `folder`. Raises SinewError where they cannot be written."""
    paths = folder / "report.html", folder / "report.json"
    for path, text in zip(paths, (to_html(page), to_json(page)), strict=True):
        write_text(path, text)
    return paths


def to_json(page: Page) -> str:
    """Returns everything on the page; for pictures only the captions."""

    def plain(part: Table | Figure) -> dict[str, object]:
        fields = asdict(part)
        del fields["number"]
        if "pictures" in fields:
            fields["pictures"] = [picture["caption"] for picture in fields["pictures"]]
        return fields

    content = {
        "version": page.version,
        "machine": page.machine,
        "quick": page.quick,
        "tables": {table.number: plain(table) for table in page.tables},
        "figures": {figure.number: plain(figure) for figure in page.figures},
        "answers": [asdict(answer) for answer in page.answers],
        "studies": page.studies,
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def to_html(page: Page) -> str:
    warning = (
        '<p class="missing">Made in quick mode: the times are of loops a thousand times shorter, run once, '
        "and say nothing.</p>"
        if page.quick
        else ""
    )
    machine = "".join(
        f"<tr><td>{escape(key)}</td><td>{escape(value)}</td></tr>" for key, value in page.machine.items()
    )
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escape(TITLE)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>",
            f"<h1>{escape(TITLE)}</h1>",
            "<p>Tables 3.1 to 3.10 and Figures 3.3 to 3.11 of M. Smith, <i>Applications of Dual Quaternions "
            "in Three Dimensional Transformation and Interpolation</i> (University of Canterbury, 2013): "
            f"what is printed there beside what Sinew gives here. {escape(headline(page))}</p>",
            warning,
            '<h2>What it comes to</h2>\n<dl class="answers">',
            *(_answer(answer) for answer in page.answers),
            "</dl>\n<h2>Tables</h2>",
            *(_table(table) for table in page.tables),
            "<h2>Figures</h2>",
            *(_figure(figure) for figure in page.figures),
            "<h2>Made with</h2>",
            f"<table><tr><td>Sinew</td><td>{escape(page.version)}</td></tr>{machine}</table>",
            "</body>\n</html>\n",
        ]
    )


def headline(page: Page) -> str:
    """Returns a sentence about what agrees, and what is missing."""
    agree, of = agreement(page)
    missing = sum(table.missing is not None for table in page.tables)
    missing += sum(figure.missing is not None for figure in page.figures)
    text = f"Of {of} rows and statements here, {agree} agree; why the others do not stands beside them."
    if missing:
        of_parts = len(page.tables) + len(page.figures)
        text += f" {missing} of {of_parts} tables and figures are missing: they say how to have them."
    return text


def agreement(page: Page) -> tuple[int, int]:
    """Returns how many rows and statements agree, and how many have something to compare with."""
    verdicts = [row.agrees for table in page.tables for row in table.rows if row.agrees is not None]
    facts = [table.facts for table in page.tables] + [figure.facts for figure in page.figures]
    verdicts += [fact.agrees for of_part in facts for fact in of_part]
    return sum(verdicts), len(verdicts)


def _answer(answer: Answer) -> str:
    return f"<dt>{escape(answer.question)}</dt><dd>{escape(answer.answer)}</dd>"


def _table(table: Table) -> str:
    lines = [f'<h3 id="table-{table.number}">Table {table.number}: {escape(table.title)}</h3>']
    if table.missing is not None:
        return "\n".join([*lines, f'<p class="missing">{escape(table.missing)}</p>'])
    what = f" ({', '.join(table.columns)})" if len(table.columns) > 1 else f" {table.columns[0]}"
    explains = any(row.why for row in table.rows)
    head = ["", f"Printed{what}", f"Ours{what}", "Agrees", *table.more_columns, *["Why not"] * explains]
    lines.append('<div class="scroll"><table><tr>' + "".join(f"<th>{escape(h)}</th>" for h in head) + "</tr>")
    lines += [_row(table, row, explains) for row in table.rows]
    lines += ["</table></div>", *_facts(table.facts)]
    lines += [f'<p class="faint">{escape(note)}</p>' for note in (table.tolerance, *table.notes)]
    return "\n".join(lines)


def _row(table: Table, row: Row, explains: bool) -> str:
    cells = [f'<td class="name">{escape(row.name)}</td>']
    for numbers in (row.printed, row.ours):
        cells.append(f'<td class="number">{format_numbers(numbers, table.decimals)}</td>')
    cells.append(f"<td>{_verdict(row.agrees)}</td>")
    for column in table.more_columns:
        cells.append(f'<td class="number">{_cell(row.more.get(column, ""))}</td>')
    if explains:
        cells.append(f'<td class="why">{escape(row.why)}</td>')
    return "<tr>" + "".join(cells) + "</tr>"


def format_numbers(numbers: Sequence[float] | None, decimals: int) -> str:
    if numbers is None:
        return ""
    return ", ".join(f"{number:.{decimals}f}" for number in numbers)


def _cell(value: float | str) -> str:
    if isinstance(value, str):
        return escape(value)
    if value == 0 or isinstance(value, int):
        return f"{value:g}"
    return f"{value:.2f}" if abs(value) >= 0.01 else f"{value:.1e}"


def _verdict(agrees: bool | None) -> str:
    if agrees is None:
        return ""
    return '<span class="yes">yes</span>' if agrees else '<span class="no">no</span>'


def _facts(facts: tuple[Fact, ...]) -> list[str]:
    if not facts:
        return []
    rows = [
        f"<tr><td>{escape(fact.says)}</td><td>{escape(fact.ours)}</td><td>{_verdict(fact.agrees)}</td></tr>"
        for fact in facts
    ]
    return ["<table><tr><th>The report</th><th>Ours</th><th>Agrees</th></tr>", *rows, "</table>"]


def _figure(figure: Figure) -> str:
    lines = [f'<h3 id="figure-{figure.number}">Figure {figure.number}: {escape(figure.title)}</h3>']
    if figure.pictures:
        grid = f"grid-template-columns: repeat({len(figure.pictures)}, minmax(0, 1fr))"
        lines.append(f'<div class="pictures" style="{grid}">')
        lines += [*(_picture(picture) for picture in figure.pictures), "</div>"]
    if figure.missing is not None:
        lines.append(f'<p class="missing">{escape(figure.missing)}</p>')
    lines += _facts(figure.facts)
    lines += [f'<p class="faint">{escape(note)}</p>' for note in figure.notes]
    return "\n".join(lines)


def _picture(picture: Picture) -> str:
    if isinstance(picture.content, str):
        content = picture.content
    else:
        data = base64.b64encode(picture.content).decode("ascii")
        content = f'<img alt="{escape(picture.caption)}" src="data:image/png;base64,{data}">'
    return f"<figure>{content}<figcaption>{escape(picture.caption)}</figcaption></figure>"
