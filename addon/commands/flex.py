# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew flex`: bends each joint of characters, and says which deform well."""

from __future__ import annotations

import argparse
import json
from collections.abc import Generator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

from ..blender_process import Limits
from ..core.errors import SinewError
from ..core.flex.limits import Table, read_table
from ..core.flex.report import junit, lines, markdown, of_file
from ..core.output import file_to_write, write_text
from ..jobs.workers import run_one_by_one
from .arguments import add_files, add_json, add_object, add_timeout, add_viewer, check_viewer, methods
from .console import Console

SUMMARY = "bend each joint of characters, and say which deform well"
HELP = """\
Bends every joint of every character by itself, and figures as people move, measures what that does to the
surface, and looks at weights and bones. Files are only read; actions, controls and drivers take no part.

Exit status 0: all joints pass; 1: one does not, or a file can not be judged; 2: wrong use."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    parser.add_argument(
        "--methods",
        type=methods,
        default=[],
        metavar="METHODS",
        help="others to try, of `sinew methods`, such as dq,cor: they are named where they mend a joint; the "
        "verdict is on the method that a file has",
    )
    add_object(parser)
    parser.add_argument("--poses", type=Path, metavar="TABLE.toml", help="poses of joints, in [joints]")
    parser.add_argument(
        "--thresholds", type=Path, metavar="TABLE.toml", help="limits of measures, in [limits]"
    )
    add_json(parser)
    add_timeout(parser)
    for option, ending, text in (
        ("--junit", ".xml", "for the test pages of build servers"),
        ("--markdown", ".md", "for a pull request"),
    ):
        file = partial(file_to_write, endings=(ending,))
        parser.add_argument(option, type=file, metavar=f"FILE{ending}", help=f"also write a report {text}")
    add_viewer(
        parser,
        "also write a page in which the character of the file turns, bent to each pose, with the "
        "faults as a list",
    )


def run(args: argparse.Namespace, console: Console) -> int:
    check_viewer(args)
    table = Table()
    tables = [path for path in (args.poses, args.thresholds) if path is not None]
    for path in tables:
        table = read_table(path, table)
    tasks = [
        {
            "command": "flex",
            "source": str(path.absolute()),
            "methods": args.methods,
            "object": args.object,
            "tables": [str(table.absolute()) for table in tables],
            "viewer": args.viewer and str(args.viewer.absolute()),
        }
        for path in args.files
    ]
    reports = []
    with closing(_outcomes(tasks, args, console)) as outcomes:
        for path, outcome in zip(args.files, outcomes, strict=True):
            if "error" in outcome:
                outcome["error"] = outcome["error"].removeprefix(f"{path.absolute()}: ")
            console.note_on(path, outcome.get("notes", []))
            reports.append(of_file(str(path), outcome))
            if not args.json:
                for line in lines(reports[-1]):
                    console.say(line)
    if args.json:
        console.say(json.dumps(reports, indent=2, ensure_ascii=False))
    for target, text in ((args.junit, junit), (args.markdown, markdown)):
        if target is not None:
            write_text(target, text(reports))
            console.note(str(target))
    return 0 if all(report["passed"] for report in reports) else 1


def _outcomes(
    tasks: Sequence[dict], args: argparse.Namespace, console: Console
) -> Generator[dict, None, None]:
    """Several files are bent in a Blender that they may crash; one is in this one, with its progress."""
    if len(tasks) > 1:
        outcomes = run_one_by_one(tasks, Limits(timeout=args.timeout, verbose=console.verbose))
        yield from console.progress(outcomes, len(tasks), "Bending joints")
        return
    from ..jobs.tasks import flex
    from ..prepare import prepare_blender

    prepare_blender()
    for task in tasks:
        with console.bar(f"Bending {Path(task['source']).name}", 1) as show:
            try:
                outcome = flex.flex(task, lambda _doing: None, show)
            except SinewError as error:
                outcome = {"error": str(error)}
        yield outcome
