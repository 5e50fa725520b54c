# SPDX-License-Identifier: GPL-3.0-or-later
"""The common part of `sinew reskin`, `restore` and `flex`: inputs, workers, journal, progress, report."""

import argparse
import hashlib
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeAlias

import sinew

from ..base.errors import SinewError, WrongUse
from ..base.output import folder_to_write, writing
from ..blender_process import Limits
from ..jobs.inputs import STANDARD_INPUT, Job, plan_jobs
from ..jobs.job_file import JobFile, Settings, read_job_file
from ..jobs.journal import Journal, is_complete
from ..jobs.report import PICTURES, write_report
from ..jobs.workers import run_here, run_on_this_machine, versions
from .arguments import count, seconds
from .console import BatchProgress, Console

# Seconds for a file, with its pictures.
TIMEOUT = 1800


@dataclass(frozen=True)
class Action:
    """What is done to each file.

    command   a command of worker.py
    done      a participle for the summary, as in "3 of 4 files re-skinned"
    settings  from the command line
    job       path of a job file
    methods   names of methods that can be chosen; empty where no method is needed
    """

    command: str
    done: str
    settings: Settings = field(default_factory=Settings)
    job: str | None = None
    methods: Collection[str] = ()


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_inputs(parser, "*")
    parser.add_argument(
        "--out", type=folder_to_write, metavar="DIR", help="folder for copies, journal and report"
    )
    parser.add_argument(
        "--include",
        action="append",
        metavar="NAME",
        help="only objects, or collections, of this name or pattern",
    )
    parser.add_argument("--exclude", action="append", metavar="NAME", help="but not these")
    parser.add_argument("--overwrite", action="store_true", help="replace copies that are there already")
    add_workers(parser, TIMEOUT)


def add_inputs(parser: argparse.ArgumentParser, number: str) -> None:
    parser.add_argument(
        "inputs",
        nargs=number,
        metavar="INPUT",
        help="a file, a folder (all .blend files below it), a pattern such as 'chars/**/*.blend', or - for a "
        "list of paths on standard input",
    )


def listed(inputs: Collection[str]) -> Iterable[str]:
    """The paths in standard input, which need not be valid text, where the inputs name it."""
    return map(os.fsdecode, sys.stdin.buffer) if STANDARD_INPUT in inputs else ()


def add_workers(parser: argparse.ArgumentParser, timeout: int) -> None:
    parser.add_argument("--resume", action="store_true", help="do only what is missing or has changed")
    parser.add_argument("--jobs", type=count, metavar="N", help="Blenders at a time (default: one a core)")
    parser.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="work on this dask cluster instead")
    parser.add_argument(
        "--timeout",
        type=seconds,
        metavar="SECONDS",
        help=f"how long one file may take (default: {timeout}; 0: any time)",
    )
    parser.add_argument(
        "--memory",
        metavar="SIZE",
        help="what one Blender may take, such as 4GiB (default: its share; 0: all)",
    )


def run(args: argparse.Namespace, console: Console, action: Action) -> int:
    """Returns the exit status: 0 all went well, 1 something failed or was not changed."""
    job_file = read_job_file(Path(action.job), action.methods) if action.job else JobFile()
    inputs = args.inputs or job_file.inputs
    out = args.out or (job_file.out and folder_to_write(job_file.out))
    if not inputs:
        raise WrongUse("no input: name files, folders or patterns, or - for a list on standard input")
    if out is None:
        raise WrongUse("no --out: name a folder for the copies")
    out = Path(os.path.abspath(out))
    jobs = plan_jobs(inputs, out, listed(inputs))
    given = Settings(
        include=tuple(args.include) if args.include else None,
        exclude=tuple(args.exclude) if args.exclude else None,
    )
    settings = [job_file.settings_of(job.source, action.settings.overridden_by(given)) for job in jobs]
    for job, wanted in zip(jobs, settings, strict=True):
        if action.methods and wanted.method is None:
            raise WrongUse(f"no method for {job.source}: give --method or --preset, or one in a job file")
    for rule in job_file.files:
        if not any(rule.matches(job.source) for job in jobs):
            console.note(f"{action.job}:{rule.line}: no file matches {', '.join(rule.match)}")
    workers = Workers(args, len(jobs), console, TIMEOUT)

    started = time.monotonic()
    results: dict[str, dict] = {}
    with Journal(out) as journal:
        tasks = [
            _task(args, action, job, wanted, journal) for job, wanted in zip(jobs, settings, strict=True)
        ]
        showing = Showing(partial(_show_result, console))
        do_all(args, console, journal, tasks, workers.run, showing, results)
        seconds = time.monotonic() - started
        rows = [_row(job, journal.name_of(job.target), results[str(job.target)]) for job in jobs]
        summary = _summary(action, rows, seconds)
        report = write_report(out, summary, rows)
    return _conclude(console, action, rows, summary, report)


Outcomes: TypeAlias = Generator[tuple[dict, dict], None, None]
"""Tasks with their outcomes, in the order in which they end."""


@dataclass(frozen=True)
class Showing:
    """What a command shows of a batch.

    show         called with each task and its record
    is_complete  whether a record has all that is reported
    counted      what show() counts
    rest         is said of the other files where the user interrupts it
    """

    show: Callable[[BatchProgress, dict, dict], None]
    is_complete: Callable[[dict], bool] = is_complete
    counted: str = "meshes"
    rest: str = "; --resume does the others"


def do_all(
    args: argparse.Namespace,
    console: Console,
    journal: Journal,
    tasks: Sequence[dict],
    run: Callable[[list[dict], BatchProgress], Outcomes],
    showing: Showing,
    results: dict[str, dict],
) -> None:
    """Does those of the tasks that are not done yet.

    tasks    all of one command, as of jobs.workers without "known"
    results  gets the record of each task by its target, also where the user interrupts it
    """
    targets = [Path(task["target"]) for task in tasks]
    journal.recover()
    journal.remove_unfinished(targets)
    left = []
    for task, target in zip(tasks, targets, strict=True):
        try:
            left.append({**task, "known": _known(args, task, target, journal, showing.is_complete)})
        except SinewError as error:
            results[task["target"]] = {"error": str(error)}
            console.complain(error)
    command, count = tasks[0]["command"], len(tasks)
    try:
        with (
            console.batch(f"{command} {count} file{'s' * (count > 1)}", count, showing.counted) as progress,
            closing(run(left, progress)) as outcomes,
        ):
            progress.done = len(results)
            progress.failed = len(results)
            for task, outcome in outcomes:
                result = _keep(journal, task, outcome)
                results[task["target"]] = result
                showing.show(progress, task, result)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"{len(results)} of {count} files are done{showing.rest}") from None
    finally:
        journal.remove_unfinished(targets)


class Workers:
    """The workers of a batch; the constructor checks the options before any work starts.

    timeout  seconds for each file, where the user gives none
    apart    within Blender, too, files are opened in a Blender of their own, and in several for --jobs
    """

    def __init__(
        self, args: argparse.Namespace, files: int, console: Console, timeout: int, apart: bool = False
    ) -> None:
        self._args, self._console = args, console
        bpy = sys.modules.get("bpy")
        self._inside_blender = bpy is not None and bool(bpy.app.binary_path)
        self._apart = apart
        if self._inside_blender:
            for option in ("scheduler", "memory", *(["timeout"] * (not apart))):
                if getattr(args, option) is not None:
                    raise WrongUse(_needs_python(f"--{option}"))
            if args.jobs is not None and args.jobs > 1 and not apart:
                raise WrongUse(_needs_python("--jobs"))
        if args.scheduler is not None and args.jobs is not None:
            raise WrongUse("--jobs and --scheduler: the cluster's workers decide how many Blenders it runs")
        self._jobs = min(args.jobs or (not self._inside_blender and os.cpu_count()) or 1, files)
        self._limits = Limits(
            timeout=timeout if args.timeout is None else args.timeout,
            memory=self._memory(args.memory),
            # More threads would only wait for each other.
            threads=0 if args.scheduler is not None else max(1, _processors() // self._jobs),
            verbose=console.verbose,
        )

    def run(self, tasks: list[dict], progress: BatchProgress) -> Outcomes:
        if not tasks or (self._inside_blender and not self._apart):
            return self.run_here(tasks, progress)
        if self._args.scheduler is not None:
            try:
                from ..jobs.dask_cluster import run_in_dask
            except ImportError:
                raise SinewError("--scheduler needs dask: pip install 'sinew-blender[cluster]'") from None

            return run_in_dask(tasks, self._limits, self._args.scheduler, self._console.complain)
        return run_on_this_machine(tasks, self._limits, self._jobs, self._versions)

    def run_here(self, tasks: list[dict], progress: BatchProgress) -> Outcomes:
        """In this process, which a crash ends."""
        from .. import worker
        from ..prepare import prepare_blender

        def report(_doing: str, share: float = 0.0) -> None:
            progress.show_share(share)

        if tasks:
            prepare_blender()
        return run_here(tasks, lambda task: worker.run(task, report), self._versions)

    def _versions(self) -> dict[str, str]:
        """Of this Python, or of this Blender."""
        if not self._inside_blender:
            return versions()
        import bpy

        return {"sinew": sinew.__version__, "blender": bpy.app.version_string}

    def _memory(self, text: str | None) -> int:
        if text is None:
            if self._args.scheduler is not None or self._inside_blender:
                return 0
            import psutil

            return psutil.virtual_memory().total // self._jobs
        found = re.fullmatch(r"(\d+(?:\.\d+)?) *([KMGT]?)(i?)B?", text.strip(), re.IGNORECASE)
        if found is None:
            raise WrongUse(f"--memory: expected a size such as 4GiB, got {text!r}")
        power = " KMGT".index(found[2].upper() or " ")
        return int(float(found[1]) * (1024 if found[3] else 1000) ** power)


def _processors() -> int:
    """Returns the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _needs_python(option: str) -> str:
    return (
        f"{option} needs Blenders in processes of their own, which this one can not start: install "
        "sinew-blender in a Python with bpy and run `sinew` there"
    )


def _task(args: argparse.Namespace, action: Action, job: Job, settings: Settings, journal: Journal) -> dict:
    name = hashlib.blake2b(os.fsencode(journal.name_of(job.target)), digest_size=8).hexdigest()
    return {
        "command": action.command,
        "source": str(job.source),
        "target": str(job.target),
        "writes": True,
        "settings": settings.as_task(),
        "frames": args.frames,
        "pictures": str(journal.out / PICTURES / name) if args.pictures else None,
        "overwrite": args.overwrite,
    }


def _known(
    args: argparse.Namespace,
    task: dict,
    target: Path,
    journal: Journal,
    is_complete: Callable[[dict], bool],
) -> dict | None:
    """Returns the hash and the versions with which the copy is up to date; None where it has to be written.
    Raises SinewError where it must not be replaced."""
    record = journal.latest.get(journal.name_of(target))
    may_react = journal.matches(target, record)
    if task["writes"] and target.exists() and not args.overwrite and not (args.resume and may_react):
        if args.resume and record is not None:
            raise SinewError(f"{target}: was changed since it was written; use --overwrite to replace it")
        raise SinewError(f"{target}: is there already; use --overwrite to replace it, or --resume to go on")
    same = ("command", "source", "settings")
    if record is None or not args.resume or not may_react or "error" in record:
        return None
    if is_complete(record) and all(record.get(k) == task[k] for k in same):
        return {"hash": record["hash"], "versions": record["versions"]}
    return None


def _keep(journal: Journal, task: dict, outcome: dict) -> dict:
    """Records the outcome of a task, renames its copy, and returns the record."""
    target = Path(task["target"])
    before = journal.latest.get(journal.name_of(target), {})
    if "unchanged" in outcome:
        return {**before, "unchanged": True}
    record = {key: task[key] for key in ("command", "source", "settings")} | outcome
    if "error" in record:
        _record_failure(journal, target, record, before)
        return record
    journal.record(target, record)
    if not task["writes"]:
        return record
    try:
        with writing(target):
            journal.finish(target, record)
    except SinewError as error:
        record["error"] = str(error)
        _record_failure(journal, target, record, before)
    return record


def _record_failure(journal: Journal, target: Path, record: dict, before: dict) -> None:
    record.pop("unfinished", None)
    # The older copy still exists, and belongs to this batch.
    record.pop("written", None)
    if "written" in before:
        record["written"] = before["written"]
    journal.record(target, record)


def _show_result(console: Console, progress: BatchProgress, task: dict, result: dict) -> None:
    if "error" in result:
        console.complain(result["error"])
        progress.step(None, 0, failed=True)
        return
    meshes = len(result["meshes"])
    what = "unchanged"
    if "unchanged" not in result:
        what = f"{meshes} mesh{'' if meshes == 1 else 'es'}, {sum(result['seconds'].values()):.1f} s"
    for reason in result["left_out"]:
        console.complain(f"{task['source']}: left as it was: {reason}")
    progress.step(f"{task['source']}: {what}", meshes, failed=bool(result["left_out"]))


def _row(job: Job, name: str, result: dict) -> dict:
    """Returns the entry of a file in the report."""
    status = "failed" if "error" in result else "unchanged" if "unchanged" in result else "written"
    shown = ("error", "meshes", "left_out", "notes", "versions", "seconds", "attempts", "pictures")
    return {"source": str(job.source), "file": name, "status": status} | {
        key: result[key] for key in shown if key in result
    }


def _summary(action: Action, rows: list[dict], seconds: float) -> dict:
    statuses = Counter(row["status"] for row in rows)
    good = [row for row in rows if row["status"] != "failed"]
    return {
        "command": action.command,
        "files": len(rows),
        "written": statuses["written"],
        "unchanged": statuses["unchanged"],
        "failed": statuses["failed"],
        "meshes": sum(len(row["meshes"]) for row in good),
        "meshes_left_out": sum(len(row["left_out"]) for row in good),
        "seconds": round(seconds, 3),
    }


def _conclude(console: Console, action: Action, rows: list[dict], summary: dict, report: Path) -> int:
    complete = [row for row in rows if row["status"] != "failed" and not row["left_out"]]
    bad = [row for row in rows if row not in complete]
    if bad:
        console.table(("file", "result"), [(row["source"], _reason(row)) for row in bad])
    unchanged = f", {summary['unchanged']} of them before" if summary["unchanged"] else ""
    console.say(f"{len(complete)} of {len(rows)} files {action.done}{unchanged}")
    console.say(str(report))
    return 1 if bad else 0


def _reason(row: dict) -> str:
    if "error" in row:
        return row["error"].removeprefix(f"{row['source']}: ")
    return f"left as they were: {'; '.join(row['left_out'])}"
