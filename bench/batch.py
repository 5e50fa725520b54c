#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a batch costs beside Blender's own opening and saving, and what a second Blender brings.

    .venv/bin/python bench/batch.py [--files 48] [--repetitions 5] [--json FILE]

The time of a file is the slope between a long and a short batch, so that no start counts; candidates take
turns, and the least of each is taken, as on a shared machine only that is the machine's own.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

WRIST = Path(__file__).resolve().parents[1] / "blend_files" / "wrist.blend"
SINEW = [sys.executable, "-c", "from sinew_addon.cli import run; run()"]

OPEN_AND_SAVE = """
import sys, time, bpy
target, *paths = sys.argv[1:]
started = time.perf_counter()
for path in paths:
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=True, use_scripts=False)
    bpy.ops.wm.save_as_mainfile(filepath=target, copy=True, check_existing=False, compress=True)
print("seconds", time.perf_counter() - started)
"""

SUBDIVIDE = """
import sys, bpy
source, target, times = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=source)
obj = next(o for o in bpy.data.objects if o.type == "MESH" and o.find_armature())
bpy.context.view_layer.objects.active = obj
if int(times):
    modifier = obj.modifiers.new("Finer", "SUBSURF")
    modifier.levels = int(times)
    bpy.ops.object.modifier_move_to_index(modifier="Finer", index=0)
    bpy.ops.object.modifier_apply(modifier="Finer")
bpy.ops.wm.save_as_mainfile(filepath=target, copy=True, compress=True)
print("vertices", len(obj.data.vertices))
"""


def run(command: list[str]) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def number(output: str, name: str) -> float:
    """The one on the line that begins with `name`, among what Blender prints."""
    return float(next(line.split()[1] for line in output.splitlines() if line.startswith(name + " ")))


def plain(folder: Path) -> float:
    """Seconds for opening and saving each file of a folder in one Blender, started before."""
    paths = [str(path) for path in sorted(folder.glob("*.blend"))]
    return number(run([sys.executable, "-c", OPEN_AND_SAVE, str(folder / "plain.out"), *paths]), "seconds")


def batch(folder: Path, *options: str) -> tuple[float, dict[str, float]]:
    """Seconds for a whole batch, and what of it each step took, summed over files."""
    with tempfile.TemporaryDirectory(dir=folder.parent) as out:
        started = time.perf_counter()
        run([*SINEW, "reskin", str(folder), "--method", "dq", "--out", out, *options])
        seconds = time.perf_counter() - started
        rows = json.loads(Path(out, "report.json").read_text(encoding="utf-8"))["files"]
    return seconds, {
        step: sum(row["seconds"][step] for row in rows) for step in ("opening", "deforming", "saving")
    }


def measure(source: Path, files: int, repetitions: int, work: Path) -> dict[str, float]:
    """Milliseconds a file."""
    short, long = work / "short", work / "long"
    for folder, count in ((short, files // 4), (long, files)):
        folder.mkdir()
        for index in range(count):
            shutil.copy(source, folder / f"{index:03d}.blend")
    bare = ("--frames", "none", "--no-pictures")
    candidates = {
        "open and save": plain,
        "batch": lambda folder: batch(folder, *bare, "--jobs", "1")[0],
        "batch, compared": lambda folder: batch(folder, "--no-pictures", "--jobs", "1")[0],
        "batch, compared, pictures": lambda folder: batch(folder, "--jobs", "1")[0],
        "batch, 2 jobs": lambda folder: batch(folder, *bare, "--jobs", "2")[0],
        "batch, compared, 2 jobs": lambda folder: batch(folder, "--no-pictures", "--jobs", "2")[0],
    }
    least: dict[tuple[str, Path], float] = {}
    inside: list[dict[str, float]] = []
    for repetition in range(repetitions):
        for name, candidate in candidates.items():
            if "pictures" in name and repetition > 0:
                continue  # seconds, not milliseconds
            for folder in (short, long):
                seconds = candidate(folder)
                least[name, folder] = min(least.get((name, folder), seconds), seconds)
        inside.append(batch(long, *bare, "--jobs", "1")[1])
    extra = files - files // 4
    result = {
        name: round(1000 * (least[name, long] - least[name, short]) / extra, 2) for name in candidates
    }
    for step in ("opening", "deforming", "saving"):
        result[f"inside: {step}"] = round(1000 * min(times[step] for times in inside) / files, 2)
    result["beside opening, deforming, saving"] = round(
        result["batch"] - sum(value for name, value in result.items() if name.startswith("inside")), 2
    )
    result["2 jobs, times as fast"] = round(result["batch"] / result["batch, 2 jobs"], 2)
    result["2 jobs, compared, times as fast"] = round(
        result["batch, compared"] / result["batch, compared, 2 jobs"], 2
    )
    shutil.rmtree(short)
    shutil.rmtree(long)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=48)
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    results: dict[str, object] = {
        "bpy": importlib.metadata.version("bpy"),
        "cores": os.cpu_count(),
        "unit": "milliseconds a file",
    }
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for times, share in ((0, 1), (3, 4)):
            source = work / f"{times}.blend"
            command = [sys.executable, "-c", SUBDIVIDE, str(WRIST), str(source), str(times)]
            vertices = number(run(command), "vertices")
            name = f"{vertices:,.0f} vertices, {source.stat().st_size / 1e6:.1f} MB"
            results[name] = measure(source, options.files // share, options.repetitions, work)
            print(name)
            for what, value in results[name].items():
                print(f"  {what:36} {value:9.2f}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
