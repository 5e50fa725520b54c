# SPDX-License-Identifier: GPL-3.0-or-later
"""One HTML page that needs nothing beside itself, and the same as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from ..html_templates import render
from ..output import write_text
from .model import Figure, Page, Table

TITLE = "Dual quaternions in transformation and interpolation: the report's experiments, done again"


def write(page: Page, folder: Path) -> tuple[Path, Path]:
    """report.html and report.json in `folder`. Raises SinewError where one can not be written."""
    html, json_file = folder / "report.html", folder / "report.json"
    # First what every Python can write.
    write_text(json_file, to_json(page))
    write_text(html, to_html(page))
    return html, json_file


def to_json(page: Page) -> str:
    """All that the page says; of pictures the captions."""

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
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def to_html(page: Page) -> str:
    """Raises SinewError where Jinja2 is missing."""
    agree, of = agreement(page)
    return render(
        "report.html",
        title=TITLE,
        page=page,
        agree=agree,
        of=of,
        format_numbers=format_numbers,
        format_cell=_format_cell,
    )


def agreement(page: Page) -> tuple[int, int]:
    """How many rows and statements agree, and of how many that have something to agree with."""
    verdicts = [row.agrees for table in page.tables for row in table.rows if row.agrees is not None]
    verdicts += [fact.agrees for figure in page.figures for fact in figure.facts]
    return sum(verdicts), len(verdicts)


def format_numbers(numbers: Sequence[float] | None, decimals: int) -> str:
    """Of a row; empty where it has none."""
    if numbers is None:
        return ""
    return ", ".join(f"{number:.{decimals}f}" for number in numbers)


def _format_cell(value: float | str) -> str:
    if isinstance(value, str):
        return value
    if value == 0 or isinstance(value, int):
        return f"{value:g}"
    return f"{value:.2f}" if abs(value) >= 0.01 else f"{value:.1e}"
