# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what players make of skins: `./dev players`. Blender makes files (make_files.py), each player
plays them in a process of its own (adapters/), and the distances from what Blender showed are written to
addon/features/gltf/players.json and to the table of docs/players.md.

python tools/players/measure.py --bpy VERSION=PYTHON [--bpy ...] [--work FOLDER] [NAME ...]
"""

from __future__ import annotations

import argparse
import datetime
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from glb import write_still
from scipy import ndimage
from scipy.spatial import cKDTree

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DOCUMENT, FIGURES = ROOT / "docs/players.md", ROOT / "addon/features/gltf/players.json"
SECONDS = 120
# The height of what the camera of outlines sees, in metres at the tube, and of a picture in pixels.
SEEN = 2.0 * 24.0 * np.tan(np.radians(15.0))

# By the names of files, what the table calls their properties.
COLUMNS = {
    "plain": "skin at all",
    "six": "six influences",
    "loose": "weights of sum ½",
    "unequal": "unequal scale",
    "mirrored": "mirrored bone",
    "scaled_above": "scale above",
    "two_keys": "between keys",
    "two_clips": "second clip",
    "morph": "morph and skin",
    "bytes": "8-bit weights",
    "shorts": "16-bit integers",
}


@dataclass(frozen=True)
class Row:
    """
    name     of the player, as `sinew export --for` has it
    label    of the row
    adapter  a program of adapters/
    ending   of the files
    bpy      its version, for Blender's importers
    unread   the files that its adapter can not judge
    """

    name: str
    label: str
    adapter: str
    ending: str = ".glb"
    bpy: str = ""
    unread: tuple[str, ...] = ()


OTHERS = [
    Row("three.js", "three.js", "threejs"),
    Row("babylon.js", "Babylon.js", "babylon"),
    # Its clips have no time: no keys lie between others.
    Row("viser", "viser", "viser_view", unread=("two_keys",)),
    Row("f3d", "F3D", "f3d_view"),
    Row("vtk", "VTK's reader", "vtk_reader"),
    Row("vtk-importer", "VTK's importer", "vtk_importer"),
    Row("pyvista", "PyVista", "pyvista_read"),
    Row("panda3d", "panda3d", "panda"),
    Row("pygfx", "pygfx", "pygfx_view"),
    Row("trimesh", "trimesh", "trimesh_load"),
    Row("open3d", "Open3D", "open3d_read"),
    Row("mujoco", "MuJoCo", "mujoco_compile"),
    Row("assimp", "assimp", "assimp_read", unread=("morph",)),
    Row("assimp", "assimp, .fbx", "assimp_read", ".fbx", unread=("morph",)),
    Row("usdskel", "UsdSkel, .usdc", "usdskel", ".usdc"),
    Row("ufbx", "ufbx, .fbx", "ufbx_evaluate", ".fbx"),
]


def rows_of(versions: list[str]) -> list[Row]:
    own = [
        Row("blender", f"Blender {version}, {ending}", "blender", ending, version)
        for version in versions
        for ending in (".glb", ".usdc", ".fbx")
    ]
    return own + OTHERS


def distance_of_points(found: dict, made: dict) -> tuple[float, bool]:
    """How far vertices are at most, in metres, and whether all stand still. Players split vertices and have
    them in other orders, sometimes scaled: each is the one at the same place of the rest pose's box."""
    rest, points = found["rest"].astype(float), found["points"].astype(float)
    own, others = (
        (each - each.min(axis=0)) / np.maximum(np.ptp(each, axis=0), 1e-12) for each in (rest, made["rest"])
    )
    apart, vertices = cKDTree(others).query(own)
    if apart.max() > 1e-3 or len(np.unique(vertices)) < len(others):
        raise ValueError("other vertices than those of the file")
    still = bool(np.ptp(points, axis=0).max() <= 1e-6)
    return float(np.linalg.norm(points - made["shown"][:, vertices], axis=2).max()), still


def distance_of_outlines(found: dict) -> tuple[float, bool]:
    """How far a pixel that only one of the two outlines covers is from the other outline, in metres."""
    outlines, most = found["outlines"], 0.0
    for one, other in zip(outlines, found["still"], strict=True):
        for a, b in ((one, other), (other, one)):
            if not b.any():
                raise ValueError("nothing is drawn")
            most = max(most, float(ndimage.distance_transform_edt(~b)[a].max(initial=0.0)))
    return most * SEEN / outlines.shape[1], bool((outlines == outlines[0]).all())


def run(row: Row, pythons: dict[str, str], file: Path, made: dict, work: Path) -> dict:
    """The cell of a file: a distance, or what the player does in place of it."""
    out = work / "played.npz"
    out.unlink(missing_ok=True)
    stills = [work / f"still{number}.glb" for number in range(len(made["shown"]))]
    for path, points in zip(stills, made["shown"], strict=True):
        write_still(path, points, made["triangles"])
    words = pythons[row.bpy], HERE / f"adapters/{row.adapter}.py", file, out, "--clip", made["clip"]
    words += "--times", ",".join(map(str, made["times"])), "--still", *stills
    try:
        done = subprocess.run(
            [*map(str, words)], capture_output=True, text=True, timeout=SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return {"said": f"takes more than {SECONDS} s"}
    if not out.exists():
        lines = [line.strip() for line in (done.stderr + done.stdout).splitlines() if line.strip()]
        errors = [line for line in lines if "Error" in line] or lines[-1:] or [f"ends by {done.returncode}"]
        return {"said": errors[-1].replace(f"{file.parent}/", "")[:120]}
    with np.load(out) as arrays:
        found = dict(arrays)
    cell: dict = {"version": str(found["version"])}
    if "missing" in found:
        raise LookupError(str(found["missing"]))
    if "said" in found:
        return {**cell, "said": str(found["said"]).replace(f"{file.parent}/", "")}
    try:
        distance, still = (distance_of_outlines if "outlines" in found else distance_of_points)(
            *((found, made) if "rest" in found else (found,))
        )
    except ValueError as error:
        return {**cell, "said": str(error)}
    cell |= {"distance": float(f"{distance:.2g}")}
    cell |= {"outline": True} if "outlines" in found else {}
    return {**cell, **({"rest": True} if still else {})}


def measured(row: Row, pythons: dict[str, str], files: Path, work: Path) -> Iterator[tuple[str, dict]]:
    for name in COLUMNS:
        file = files / f"{name}{row.ending}"
        if not file.exists() or name in row.unread:
            continue
        with np.load(files / f"{name}.npz") as arrays:
            made = {**arrays, "clip": int(arrays["clip"])}
        cell = run(row, pythons, file, made, work)
        yield name, cell
        if name == "plain" and ("said" in cell or "rest" in cell):
            # It has no skin: further files say nothing.
            return


def shown(name: str, cell: dict | None) -> str:
    if cell is None:
        return ""
    if "said" in cell:
        return "no skin" if name == "plain" else "fails"
    text = length(cell["distance"])
    if cell.get("outline") and cell["distance"] < 1.5 * SEEN / 1024:
        text = "< 0.02"
    return f"rest pose ({text})" if cell.get("rest") and name == "plain" else text


def length(metres: float) -> str:
    """Two digits, and nothing below rounding."""
    digits = 5 if metres < 1e-3 else 1 - int(np.floor(np.log10(metres)))
    return f"{metres:.{max(digits, 0)}f}" if metres >= 5e-6 else "0"


def table_of(figures: list[dict]) -> str:
    lines = ["| player | version | date | " + " | ".join(COLUMNS.values()) + " |"]
    lines.append("|---" * (3 + len(COLUMNS)) + "|")
    for row in figures:
        cells = [shown(name, row["cells"].get(name)) for name in COLUMNS]
        lines.append("| " + " | ".join([row["label"], row["version"], row["date"], *cells]) + " |")
    said = [
        f"- {row['label']}, {COLUMNS[name]}: {cell['said']}"
        for row in figures
        for name, cell in row["cells"].items()
        if "said" in cell
    ]
    return "\n".join([*lines, "", *said]) + "\n"


def write_document(figures: list[dict]) -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    start, end = "<!-- table: ./dev players -->\n", "<!-- end of the table -->"
    before, rest = text.split(start)
    _old, after = rest.split(end)
    DOCUMENT.write_text(f"{before}{start}\n{table_of(figures)}\n{end}{after}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(prog="./dev players", allow_abbrev=False)
    parser.add_argument("--bpy", action="append", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--work", type=Path, default=ROOT / "build/players", help=argparse.SUPPRESS)
    parser.add_argument("names", nargs="*", metavar="NAME")
    given = parser.parse_args()
    pythons = {"": sys.executable, **dict(each.split("=", 1) for each in given.bpy)}
    rows = rows_of([version for version in pythons if version])
    names = {row.name for row in rows}
    if not names.issuperset(given.names):
        parser.error(f"the players are {', '.join(sorted(names))}")
    work, files = given.work, given.work / "files"
    work.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [list(pythons.values())[-1], HERE / "make_files.py", files], stdout=subprocess.DEVNULL, check=True
    )
    known = {row["label"]: row for row in json.loads(FIGURES.read_text(encoding="utf-8"))}
    for row in rows:
        if given.names and row.name not in given.names:
            continue
        cells, version = {}, row.bpy
        try:
            for name, cell in measured(row, pythons, files, work):
                version = cell.pop("version", version)
                cells[name] = cell
                print(f"{row.label}: {COLUMNS[name]}: {shown(name, cell)} {cell.get('said', '')}", flush=True)
        except LookupError as error:
            print(f"{row.label}: left as it was, as this needs {error.args[0]}", flush=True)
            continue
        date = datetime.date.today().isoformat()
        own = {"name": row.name, "label": row.label, "ending": row.ending, "version": version, "date": date}
        known[row.label] = {**own, "cells": cells}
    figures = [known[row.label] for row in rows if row.label in known]
    FIGURES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    write_document(figures)
    print(DOCUMENT.relative_to(ROOT))


if __name__ == "__main__":
    main()
