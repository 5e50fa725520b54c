# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew check`: whether files can be rendered where they are to be, ahead of a farm."""

from __future__ import annotations

import argparse
import json
from collections.abc import Generator
from contextlib import closing
from dataclasses import asdict
from pathlib import Path

import sinew

from ..blender_process import BlenderLost, BlenderProcess, Limits
from ..core.errors import WrongUse
from ..jobs.inputs import blend_files_below
from ..other_blender import Answer, ask
from .arguments import seconds
from .console import Console

HELP = """\
Says of each file, in one line, whether Sinew deforms anything in it, and what is in the way of that: objects
that Sinew can not drive, what is left of Sinew without its settings, a Blender without Sinew. Files are only
read; a file that crashes or hangs Blender is told as such.

Exit status 0: all can be rendered; 1: something is wrong with a file, as told; 2: wrong use."""


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "check",
        help="say whether Sinew is there for files that need it, and can do what they ask: ahead of a farm",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE_OR_FOLDER", help=".blend; a folder: all below it"
    )
    parser.add_argument(
        "--blender",
        metavar="PROGRAM",
        help="the Blender that will render, if it is another: it is started in the background with its own "
        "preferences and asked for Sinew (default: the Blender that runs this)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--timeout",
        type=seconds,
        default=300.0,
        metavar="SECONDS",
        help="how long the Blender asked, and each file, may take (default: %(default)g; 0: any time)",
    )
    return parser


def run(args: argparse.Namespace, console: Console) -> int:
    paths = [path for given in args.files for path in _files_of(given)]
    answer = ask(args.blender, args.timeout) if args.blender is not None else None
    reports = []
    with closing(_checked(paths, Limits(timeout=args.timeout, verbose=console.verbose))) as outcomes:
        for path, outcome in outcomes:
            reports.append(_report(path, outcome, answer))
            if not args.json:
                console.say(_line(reports[-1]))
    if args.json:
        asked = None if answer is None else asdict(answer)
        console.say(json.dumps({"blender": asked, "files": reports}, indent=2, ensure_ascii=False))
    return 1 if any(report["problems"] for report in reports) else 0


def _files_of(given: Path) -> list[Path]:
    if not given.is_dir():
        return [given]
    found = sorted(blend_files_below(given))
    if not found:
        raise WrongUse(f"{given}: no .blend files in this folder")
    return found


def _checked(paths: list[Path], limits: Limits) -> Generator[tuple[Path, dict], None, None]:
    """Each file and what was found, by a Blender of its own that is started again where it is lost. Raises
    SinewError where none can be had."""
    blender = None
    try:
        for path in paths:
            blender = blender or BlenderProcess(limits)
            try:
                yield path, blender.run({"command": "check", "source": str(path.absolute())}, limits)
            except BlenderLost as lost:
                blender = None
                yield path, {"error": f"{lost}"}
    finally:
        if blender is not None:
            blender.end()


def _report(path: Path, outcome: dict, answer: Answer | None) -> dict:
    meshes, inbetweens = outcome.get("meshes", []), outcome.get("inbetweens", [])
    problems = list(outcome.get("problems", []))
    if "error" in outcome:
        problems.append(outcome["error"].removeprefix(f"{path.absolute()}: "))
    needs_sinew = bool(meshes or inbetweens)
    if needs_sinew and answer is not None:
        problems = [*_missing(answer), *problems]
    return {
        "file": str(path),
        "needs_sinew": needs_sinew,
        "meshes": meshes,
        "inbetweens": inbetweens,
        "problems": problems,
        "notes": outcome.get("notes", []),
    }


def _missing(answer: Answer) -> list[str]:
    """Why the other Blender can not do what Sinew does in this one."""
    there = f"{answer.program} (Blender {answer.blender})"
    if answer.problem is not None:
        return [f"needs Sinew, which {there} does not have: {answer.problem}; install and enable it there"]
    if answer.sinew != sinew.__version__:
        return [f"{there} has Sinew {answer.sinew}, this is {sinew.__version__}; install the same"]
    return []


def _line(report: dict) -> str:
    if report["problems"]:
        said = "; ".join(report["problems"])
    elif report["needs_sinew"]:
        said = f"ok: {_deformed(report)}"
    else:
        said = "ok: does not need Sinew"
    notes = f" ({'; '.join(report['notes'])})" if report["notes"] else ""
    return f"{report['file']}: {said}{notes}"


def _deformed(report: dict) -> str:
    meshes, armatures = report["meshes"], report["inbetweens"]
    said = []
    if meshes:
        methods = ", ".join(sorted({mesh["method"] for mesh in meshes}))
        said.append(f"Sinew deforms {len(meshes)} mesh{'' if len(meshes) == 1 else 'es'} by {methods}")
    if armatures:
        said.append(f"Sinew poses {', '.join(armatures)} between keys")
    return ", ".join(said)
