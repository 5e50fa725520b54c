#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the time of a batch beyond Blender's own opening and saving, and the gain from a second Blender.

    .venv/bin/python bench/batch.py [--files 48] [--repetitions 5] [--json FILE]

Times run from the first finished file to the last, so that start-up does not count. The processor's time
(user and system) is that of whole runs, including start-up. Candidates alternate, and the minimum of each is
used: other programs on a shared machine only make a run longer.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

WRIST = Path(__file__).resolve().parents[1] / "blend_files" / "wrist.blend"
# Options by what a batch does with each file.
WORK = {"bare": ("--frames", "none", "--no-pictures"), "compared": ("--no-pictures",), "drawn": ()}
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

SMALL = """
import sys, bpy
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.object.armature_add(enter_editmode=True)
first = bpy.context.object.data.edit_bones[0]
second = bpy.context.object.data.edit_bones.new("Second")
second.head, second.tail, second.parent = (0, 0, 1), (0, 0, 2), first
bpy.ops.object.mode_set(mode="OBJECT")
armature = bpy.context.object
bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=5)
obj = bpy.context.object
for index, bone in enumerate(armature.data.bones):
    obj.vertex_groups.new(name=bone.name).add(range(len(obj.data.vertices)), 0.3 + 0.4 * index, "REPLACE")
obj.modifiers.new("Armature", "ARMATURE").object = armature
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1], copy=True, compress=True)
print("vertices", len(obj.data.vertices))
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


def processor_time() -> float:
    """Seconds of processor time of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(command: list[str]) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def number(output: str, name: str) -> float:
    """The number on the line that begins with `name` in Blender's output."""
    return float(next(line.split()[1] for line in output.splitlines() if line.startswith(name + " ")))


def plain(folder: Path) -> dict[str, float]:
    """Seconds per file for opening and saving in one Blender; processor time including Blender's start."""
    paths = [str(path) for path in sorted(folder.glob("*.blend"))]
    before = processor_time()
    command = [sys.executable, "-c", OPEN_AND_SAVE, str(folder / "plain.out"), *paths]
    seconds = number(run(command), "seconds")
    return {"file": seconds / len(paths), "processor": (processor_time() - before) / len(paths)}


def batch(folder: Path, *options: str) -> dict[str, float]:
    """Seconds per file in a batch, from the first finished file to the last, and for each step of it."""
    with tempfile.TemporaryDirectory(dir=folder.parent) as out:
        command = [*SINEW, "reskin", str(folder), "--method", "dq", "--out", out, *options]
        before = processor_time()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        done = [time.perf_counter() for line in process.stderr]
        if process.wait() != 0:
            raise SystemExit("the batch failed")
        processor = (processor_time() - before) / len(done)
        rows = json.loads(Path(out, "report.json").read_text(encoding="utf-8"))["files"]
    steps = rows[0]["seconds"]
    found = {step: statistics.mean(row["seconds"][step] for row in rows[1:]) for step in steps}
    return {"file": (done[-1] - done[0]) / (len(done) - 1), "processor": processor, **found}


def measure(source: Path, files: int, repetitions: int, work: Path) -> dict[str, float]:
    """Milliseconds per file, and ratios."""
    folder = work / "files"
    folder.mkdir()
    for index in range(files):
        shutil.copy(source, folder / f"{index:03d}.blend")
    runs: dict[str, list] = defaultdict(list)
    for _ in range(repetitions):
        runs["plain"].append(plain(folder))
        for name, options in WORK.items():
            runs[name].append(batch(folder, *options, "--jobs", "1"))
            runs[f"{name}, 2 jobs"].append(batch(folder, *options, "--jobs", "2"))
    shutil.rmtree(folder)

    def least(name: str, step: str) -> float:
        return min(run[step] for run in runs[name])

    beside = [run["file"] - run["opening"] - run["deforming"] - run["saving"] for run in runs["bare"]]
    # Ratios of runs adjacent in time, because other programs slow down both.
    parts = [extra / own["file"] for extra, own in zip(beside, runs["plain"], strict=True)]
    result = {
        "Blender opens and saves": 1000 * least("plain", "file"),
        "Blender opens and saves, processor": 1000 * least("plain", "processor"),
        "opening, in the batch": 1000 * least("bare", "opening"),
        "saving, in the batch": 1000 * least("bare", "saving"),
        "deforming": 1000 * least("bare", "deforming"),
        "beside those": 1000 * min(beside),
        "beside those, % of Blender's own": 100 * statistics.median(parts),
        "whole, 1 job": 1000 * least("bare", "file"),
        "whole, 1 job, processor": 1000 * least("bare", "processor"),
        "whole, 2 jobs, processor": 1000 * least("bare, 2 jobs", "processor"),
        "comparing 9 frames": 1000 * least("compared", "comparing"),
        "drawing 2 pictures": 1000 * least("drawn", "drawing"),
        "2 jobs, times as fast": least("bare", "file") / least("bare, 2 jobs", "file"),
        "2 jobs, compared, times as fast": least("compared", "file") / least("compared, 2 jobs", "file"),
        "2 jobs, drawn, times as fast": least("drawn", "file") / least("drawn, 2 jobs", "file"),
    }
    return {name: round(value, 2) for name, value in result.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=48)
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    if options.files < 4:
        parser.error(
            "--files: 4 or more, as the largest file takes half of them, and the first is not measured"
        )
    results: dict[str, object] = {
        "bpy": importlib.metadata.version("bpy"),
        "cores": os.cpu_count(),
        "load": os.getloadavg(),
        "unit": "milliseconds a file",
    }
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        sources = ((SMALL, (), 4), (SUBDIVIDE, ("0",), 1), (SUBDIVIDE, ("2",), 0.5))
        for script, times, share in sources:
            source = work / "source.blend"
            command = [sys.executable, "-c", script, *([str(WRIST)] if times else []), str(source), *times]
            vertices = number(run(command), "vertices")
            name = f"{vertices:,.0f} vertices, {source.stat().st_size / 1e6:.1f} MB"
            results[name] = measure(source, int(options.files * share), options.repetitions, work)
            print(name)
            for what, value in results[name].items():
                print(f"  {what:36} {value:9.2f}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
