# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew check`: checks whether files can be rendered, before they are sent to a render farm."""

import argparse
from contextlib import closing
from pathlib import Path

from ..base.errors import WrongUse
from ..blender_process import Limits
from ..jobs.inputs import blend_files_below
from ..jobs.workers import run_one_by_one
from .arguments import add_json, seconds
from .console import Console

SUMMARY = "check that files can be rendered with Sinew, before they are sent to a farm"
HELP = """\
Prints a line for each file: whether Sinew deforms anything in it, and what prevents that: objects that Sinew
can not deform, data of Sinew without its settings. Files are only read; a file that crashes or hangs Blender
is reported as such. Run it in the Blender that will render.

Exit status 0: all can be rendered; 1: a file has a problem; 2: wrong use."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE_OR_FOLDER", help=".blend; a folder: all below it"
    )
    add_json(parser)
    parser.add_argument(
        "--timeout",
        type=seconds,
        default=300.0,
        metavar="SECONDS",
        help="how long a file may take (default: %(default)g; 0: any time)",
    )


def run(args: argparse.Namespace, console: Console) -> int:
    paths = [path for given in args.files for path in _files_of(given)]
    reports = []
    tasks = [{"command": "check", "source": str(path.absolute())} for path in paths]
    limits = Limits(timeout=args.timeout, verbose=console.verbose)
    with closing(run_one_by_one(tasks, limits)) as outcomes:
        for path, outcome in zip(paths, outcomes, strict=True):
            reports.append(_report(path, outcome))
            if not args.json:
                console.say(line_of(reports[-1]))
    if args.json:
        console.say_json(reports)
    return 1 if any(report["problems"] for report in reports) else 0


def _files_of(given: Path) -> list[Path]:
    if not given.is_dir():
        return [given]
    found = sorted(blend_files_below(given))
    if not found:
        raise WrongUse(f"{given}: no .blend files in this folder")
    return found


def _report(path: Path, outcome: dict) -> dict:
    meshes = outcome.get("meshes", [])
    problems = list(outcome.get("problems", []))
    if "error" in outcome:
        problems.append(outcome["error"].removeprefix(f"{path.absolute()}: "))
    return {
        "file": str(path),
        "needs_sinew": bool(meshes),
        "meshes": meshes,
        "problems": problems,
        "notes": outcome.get("notes", []),
    }


def line_of(report: dict) -> str:
    """Returns the line of one file without --json."""
    if report["problems"]:
        text = "; ".join(report["problems"])
    elif report["needs_sinew"]:
        meshes, methods = report["meshes"], sorted({mesh["method"] for mesh in report["meshes"]})
        plural = "" if len(meshes) == 1 else "es"
        text = f"ok: Sinew deforms {len(meshes)} mesh{plural} by {', '.join(methods)}"
    else:
        text = "ok: does not need Sinew"
    notes = f" ({'; '.join(report['notes'])})" if report["notes"] else ""
    return f"{report['file']}: {text}{notes}"
