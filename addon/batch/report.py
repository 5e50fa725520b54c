# SPDX-License-Identifier: GPL-3.0-or-later
"""report.json and report.html: what became of each file of a batch, with the worst frame before and after."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import quote

from ..core.html_templates import can_render, render
from ..core.output import write_text

PICTURES = "report-pictures"


def write_report(out: Path, summary: dict, rows: list[dict]) -> Path:
    """Writes report.json, and report.html where this Python can make it; the path of the last."""
    path = out / "report.json"
    write_text(path, json.dumps({"summary": summary, "files": rows}, indent=1, ensure_ascii=False))
    if can_render():
        path = out / "report.html"
        write_text(path, _page(summary, rows))
    return path


def _page(summary: dict, rows: list[dict]) -> str:
    order = {"failed": 0, "written": 1, "unchanged": 2}
    rows = sorted(rows, key=lambda row: (order[row["status"]], not row.get("left_out")))
    totals = [
        ("written", summary["written"]),
        ("unchanged", summary["unchanged"]),
        ("failed", summary["failed"]),
        ("meshes", summary["meshes"]),
        ("meshes left out", summary["meshes_left_out"]),
        ("time", f"{summary['seconds']:.1f} s"),
    ]
    title = f"sinew {summary['command']}: {summary['files']} files"
    return render("batch.html", title=title, totals=totals, files=[_file(row) for row in rows])


def _file(row: dict) -> dict[str, object]:
    """What the template shows of a file."""
    shown = {"name": row["file"], "facts": _facts(row), "error": None}
    if "error" in row:
        return shown | {"error": row["error"].removeprefix(f"{row['source']}: ")}
    columns, meshes = _mesh_table(row["meshes"])
    return shown | {
        "left_out": row["left_out"],
        "notes": row["notes"],
        "columns": columns,
        "meshes": meshes,
        "bakes": row.get("bakes", ()),
        "pictures": _pictures(row["pictures"]) if "pictures" in row else (),
    }


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


def _pictures(pictures: dict) -> list[dict[str, str]]:
    return [
        {
            "name": name,
            "address": quote(f"{PICTURES}/{pictures[name]}"),
            "caption": f"{name}: {shape}, frame {pictures['frame']}",
        }
        for name, shape in (("before", "Armature modifier"), ("after", "Sinew"))
    ]


def _mesh_table(meshes: list[dict]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Heads and rows, without the columns that are empty in every row."""
    rows = [("mesh", "changed", "largest deviation", "warnings")]
    for mesh in meshes:
        method = mesh["method"]
        changed = f"{mesh['before']} → {method}" if "before" in mesh else f"{method} taken off"
        rows.append((mesh["object"], changed, _deviation(mesh), "; ".join(mesh["warnings"])))
    columns = [column for column in zip(*rows, strict=True) if any(column[1:])]
    head, *body = zip(*columns, strict=True)
    return head, body


def _deviation(mesh: dict) -> str:
    if "deviation" not in mesh:
        return ""
    share = 100 * mesh["deviation_part"]
    return f"{mesh['deviation']:.3g} ({share:.2g} % of its size) at frame {mesh['frame']}"
