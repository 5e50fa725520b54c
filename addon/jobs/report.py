# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes report.json and report.html: the result of each file of a batch, with pictures of its worst
frame."""

import json
from collections.abc import Sequence
from pathlib import Path

from ..base.errors import SinewError
from ..base.output import write_text
from ..features.pages.templates import render, require_jinja

PICTURES = "report-pictures"
TEMPLATE = Path(__file__).with_name("report.html")


def write_report(out: Path, summary: dict, rows: list[dict]) -> Path:
    """Writes both to the folder `out`; returns the path of report.html, or of report.json where this Python
    can make no pages."""
    path = out / "report.json"
    write_text(path, json.dumps({"summary": summary, "files": rows}, indent=1, ensure_ascii=False))
    try:
        require_jinja()
    except SinewError:
        return path
    order = {"failed": 0, "written": 1, "unchanged": 2}
    rows = sorted(rows, key=lambda row: (order[row["status"]], not row.get("left_out")))
    values = {"summary": summary, "rows": rows, "facts": _facts, "table": _table, "folder": PICTURES}
    write_text(out / "report.html", render(TEMPLATE, **values))
    return out / "report.html"


def _facts(row: dict) -> list[str]:
    facts = [row["source"]]
    if "versions" in row:
        facts.append(f"Blender {row['versions']['blender']}, Sinew {row['versions']['sinew']}")
    if "seconds" in row:
        facts.append(f"{sum(row['seconds'].values()):.2f} s")
    if row["status"] == "unchanged":
        facts.append("done before, unchanged since")
    if row.get("attempts", 1) > 1:
        facts.append(f"{row['attempts']} attempts")
    return facts


def _table(meshes: list[dict]) -> Sequence[Sequence[str]]:
    """Returns the head, and a row for each mesh, without empty columns."""
    rows = [("mesh", "changed", "largest deviation", "warnings")]
    for mesh in meshes:
        deviation = ""
        if "deviation" in mesh:
            share = f"{100 * mesh['deviation_part']:.2g} % of its size"
            deviation = f"{mesh['deviation']:.3g} ({share}) at frame {mesh['frame']}"
        change = (
            f"{mesh['before']} \u2192 {mesh['method']}" if "before" in mesh else f"{mesh['method']} taken off"
        )
        rows.append((mesh["object"], change, deviation, "; ".join(mesh["warnings"])))
    return list(zip(*(column for column in zip(*rows, strict=True) if any(column[1:])), strict=True))
