# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew flex`: bends each joint of characters, and says which deform well."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..base.errors import WrongUse
from ..base.output import folder_to_write, write_text
from ..base.scratch import scratch_folder
from ..features.flex.report import Report, junit, lines, markdown, of_file
from ..features.measure.limits import Table, read_table
from ..jobs.inputs import files_of
from ..jobs.journal import Journal, content_hash
from ..skinning.variants import BLENDER, WHOLE, Variant
from . import batch
from .arguments import add_json, add_object, add_viewer, check_viewer, file_named, methods, variants
from .console import BatchProgress, Console

SUMMARY = "bend each joint of characters, and say which deform well"
HELP = """\
Bends every joint of every character by itself, and figures as people move, measures what that does to the
surface, and looks at weights and bones. Files are only read; actions, controls and drivers take no part.

Exit status 0: all joints pass; 1: one does not, or a file can not be judged; 2: wrong use."""
TIMEOUT = 300


def add_arguments(parser: argparse.ArgumentParser) -> None:
    batch.add_inputs(parser, "+")
    parser.add_argument(
        "--methods",
        type=methods,
        default=[],
        metavar="METHODS",
        help="others to try, of `sinew methods`, such as dq,cor: they are named where they mend a joint; the "
        "verdict is on the method that a file has",
    )
    parser.add_argument(
        "--variants",
        type=variants,
        default=[],
        metavar="VARIANTS",
        help="others to try, with their stages, as of `sinew compare`, such as dq+delta_mush",
    )
    add_object(parser)
    parser.add_argument("--poses", type=Path, metavar="TABLE.toml", help="poses of joints, in [joints]")
    parser.add_argument(
        "--thresholds", type=Path, metavar="TABLE.toml", help="limits of measures, in [limits]"
    )
    add_json(parser)
    for option, ending, text in (
        ("--junit", ".xml", "for the test pages of build servers"),
        ("--markdown", ".md", "for a pull request"),
    ):
        parser.add_argument(
            option, type=file_named(ending), metavar=f"FILE{ending}", help=f"also write a report {text}"
        )
    add_viewer(
        parser,
        "also write a page in which the character of the file turns, bent to each pose, with the faults as a "
        "list",
    )
    parser.add_argument(
        "--out", type=folder_to_write, metavar="DIR", help="folder for the journal and report.json"
    )
    batch.add_workers(parser, TIMEOUT)


def run(args: argparse.Namespace, console: Console) -> int:
    tables = [path.absolute() for path in (args.poses, args.thresholds) if path is not None]
    table = Table()
    for path in tables:
        table = read_table(path, table)
    if args.resume and args.out is None:
        raise WrongUse("--resume: name the folder of the journal by --out")
    with scratch_folder() if args.out is None else nullcontext(args.out.absolute()) as out:
        return _run(args, console, tables, out)


def _run(args: argparse.Namespace, console: Console, tables: Sequence[Path], out: Path) -> int:
    """out: folder of the journal"""
    names = _names(args.inputs, out)
    check_viewer(args.viewer, len(names))
    settings = {
        "methods": [*args.methods, *_keys(args.variants)],
        "object": args.object,
        # With what is in them, so that --resume knows them again.
        "tables": [[str(path), content_hash(path)] for path in tables],
        "viewer": args.viewer and str(args.viewer.absolute()),
    }
    # Nothing is written to a target: it is the name of the file in the journal.
    targets = {path: str(out / path.relative_to(path.anchor)) for path in names}
    tasks = [
        {"command": "flex", "source": str(path), "target": target, "writes": False, "settings": settings}
        for path, target in targets.items()
    ]
    workers = batch.Workers(args, len(tasks), console, TIMEOUT, apart=True)
    limits = args.jobs, args.scheduler, args.timeout, args.memory
    is_here = len(tasks) == 1 and all(limit is None for limit in limits)
    run = workers.run_here if is_here else workers.run
    results: dict[str, dict] = {}
    showing = batch.Showing(partial(_show, console, names), partial(_is_complete, args.viewer), "joints")
    if args.out is None:
        showing = replace(showing, rest="")
    try:
        with Journal(out) as journal:
            batch.do_all(args, console, journal, tasks, run, showing, results)
    finally:
        done = {path: results[target] for path, target in targets.items() if target in results}
        reports = [_report(names[path], path, outcome) for path, outcome in done.items()]
        for report in () if args.json else reports:
            console.say("\n".join(lines(report)))
    if args.json:
        console.say_json(reports)
    if args.out is not None:
        write_text(out / "report.json", json.dumps(reports, indent=2, ensure_ascii=False))
    for target, text in ((args.junit, junit), (args.markdown, markdown)):
        if target is not None:
            write_text(target, text(reports))
            console.note(str(target))
    return 0 if all(report["passed"] for report in reports) else 1


def _keys(tried: Sequence[Variant]) -> list[str]:
    """Raises WrongUse."""
    for each in tried:
        if each.method in WHOLE and each.method != BLENDER:
            raise WrongUse(
                f"--variants: {each.method} says nothing of its own: name a method with its stages"
            )
    return [each.key for each in tried]


def _names(inputs: Sequence[str], out: Path) -> dict[Path, str]:
    """Returns the absolute paths of the files, with what they are called in reports. Raises WrongUse."""
    names: dict[Path, str] = {}
    for given in inputs:
        _root, paths = files_of(given, out, batch.listed(inputs))
        for path in paths:
            name = str(path) if os.path.isabs(given) else os.path.relpath(path)
            names.setdefault(path, given if path == Path(given).absolute() else name)
    return names


def _show(
    console: Console, names: Mapping[Path, str], progress: BatchProgress, task: dict, result: dict
) -> None:
    path = Path(task["source"])
    report = _report(names[path], path, result)
    console.note_on(Path(names[path]), result.get("notes", []))
    line = f"{next(lines(report))}{', unchanged' if 'unchanged' in result else ''}"
    joints = len(report.get("joints", []))
    progress.step(line if len(names) > 1 else None, joints, not report["passed"])


def _report(name: str, path: Path, outcome: dict) -> Report:
    if "error" in outcome:
        outcome = {**outcome, "error": outcome["error"].removeprefix(f"{path}: ")}
    return of_file(name, outcome)


def _is_complete(page: Path | None, record: dict) -> bool:
    """Whether a record can be reported, and the page is there."""
    with suppress(AttributeError, KeyError, TypeError):
        report = of_file("", record)
        return bool(junit([report]) and markdown([report]) and list(lines(report))) and (
            page is None or page.exists()
        )
    return False
