# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes report.json and report.html: the result of each file of a batch, with pictures of its worst
frame."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from urllib.parse import quote

from ..core.output import write_text

PICTURES = "report-pictures"

STYLE = """
:root { color-scheme: light dark; --line: #8884; --bad: #c0392b; --note: #b9770e; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin: 0; overflow-wrap: anywhere; }
table { border-collapse: collapse; margin-top: .4rem; }
td, th { padding: .15rem .9rem .15rem 0; text-align: left; vertical-align: top; overflow-wrap: break-word; }
.sum td { font-size: 1.2rem; font-weight: 600; padding-right: 2rem; }
.sum th { font-weight: 400; opacity: .7; padding-right: 2rem; }
section { border-top: 1px solid var(--line); padding: 1rem 0; }
.path { opacity: .7; overflow-wrap: anywhere; } .bad { color: var(--bad); } .note { color: var(--note); }
.pair { display: flex; flex-wrap: wrap; gap: 1rem; margin-top: .6rem; }
figure { margin: 0; } figcaption { opacity: .7; }
img { max-width: 360px; max-height: 360px; background: #2a2c30; border-radius: 4px; }
.num { text-align: right; font-variant-numeric: tabular-nums; }
"""


def write_report(out: Path, summary: dict, rows: list[dict]) -> Path:
    """Writes both to the folder `out`; returns the path of report.html."""
    write_text(
        out / "report.json",
        json.dumps({"summary": summary, "files": rows}, indent=1, ensure_ascii=False),
    )
    path = out / "report.html"
    write_text(path, _page(summary, rows))
    return path


def _page(summary: dict, rows: list[dict]) -> str:
    order = {"failed": 0, "written": 1, "unchanged": 2}
    rows = sorted(rows, key=lambda row: (order[row["status"]], not row.get("left_out")))
    title = f"sinew {summary['command']}: {summary['files']} files"
    cells = [
        ("written", summary["written"]),
        ("unchanged", summary["unchanged"]),
        ("failed", summary["failed"]),
        ("meshes", summary["meshes"]),
        ("meshes left out", summary["meshes_left_out"]),
        ("time", f"{summary['seconds']:.1f} s"),
    ]
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head><body>'
        f'<h1>{escape(title)}</h1><table class="sum"><tr>'
        + "".join(f"<td>{value}</td>" for _name, value in cells)
        + "</tr><tr>"
        + "".join(f"<th>{name}</th>" for name, _value in cells)
        + "</tr></table>"
        + "".join(_section(row) for row in rows)
        + "</body></html>\n"
    )


def _section(row: dict) -> str:
    parts = [f"<section><h2>{escape(row['file'])}</h2>"]
    facts = [row["source"]]
    if "versions" in row:
        facts.append(f"Blender {row['versions']['blender']}, Sinew {row['versions']['sinew']}")
    if "seconds" in row:
        facts.append(f"{sum(row['seconds'].values()):.2f} s")
    if row["status"] == "unchanged":
        facts.append("done before, unchanged since")
    if row.get("attempts", 1) > 1:
        facts.append(f"{row['attempts']} attempts")
    parts.append(f'<div class="path">{escape(" · ".join(facts))}</div>')
    if "error" in row:
        parts.append(f'<p class="bad">{escape(_without_source(row))}</p></section>')
        return "".join(parts)
    parts += [f'<p class="bad">left as it was: {escape(reason)}</p>' for reason in row["left_out"]]
    parts += [f'<p class="note">{escape(note)}</p>' for note in row["notes"]]
    parts.append(_meshes(row["meshes"]))
    parts += [
        f"<p>{escape(bake['file'])}: {escape(bake['to'])} of {escape(', '.join(bake['objects']))}, "
        f"{bake['frames']} frames</p>"
        for bake in row.get("bakes", ())
    ]
    if "pictures" in row:
        pictures = row["pictures"]
        parts.append('<div class="pair">')
        for name, caption in (("before", "Armature modifier"), ("after", "Sinew")):
            address = quote(f"{PICTURES}/{pictures[name]}")
            parts.append(
                f'<figure><img loading="lazy" src="{address}" alt="{name}">'
                f"<figcaption>{name}: {caption}, frame {pictures['frame']}</figcaption></figure>"
            )
        parts.append("</div>")
    return "".join([*parts, "</section>"])


def _without_source(row: dict) -> str:
    return row["error"].removeprefix(f"{row['source']}: ")


def _meshes(meshes: list[dict]) -> str:
    rows = [("mesh", "changed", "largest deviation", "warnings")]
    for mesh in meshes:
        deviation = ""
        if "deviation" in mesh:
            deviation = (
                f"{mesh['deviation']:.3g} ({100 * mesh['deviation_part']:.2g} % of its size) "
                f"at frame {mesh['frame']}"
            )
        rows.append(
            (
                mesh["object"],
                f"{mesh['before']} → {mesh['method']}" if "before" in mesh else f"{mesh['method']} taken off",
                deviation,
                "; ".join(mesh["warnings"]),
            )
        )
    shown = [column for column in zip(*rows, strict=True) if any(column[1:])]
    head, *body = zip(*shown, strict=True)
    lines = [f"<th>{'</th><th>'.join(head)}</th>"]
    lines += ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in body]
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"
