# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew reskin`: copies of files in which every armature-deformed mesh uses Sinew."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import SinewError
from ..core.jobs import Job, plan_jobs
from .console import Console


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "reskin",
        help="write copies of files whose meshes are deformed by Sinew",
        description="Writes a copy of each file in which every armature-deformed mesh uses Sinew with the "
        "method chosen. Inputs are never written to. A folder stands for all .blend files below it.",
    )
    parser.add_argument("inputs", nargs="+", type=Path, metavar="FILE_OR_FOLDER")
    parser.add_argument("--method", required=True, help="a method of `sinew methods`")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the copies")
    parser.add_argument("--overwrite", action="store_true", help="replace copies that are there already")
    return parser


@dataclass
class Outcome:
    """What became of one file."""

    job: Job
    meshes: int = 0
    left_out: list[str] = field(default_factory=list)
    error: str | None = None

    @property
    def failed(self) -> bool:
        return self.error is not None or bool(self.left_out)


def run(args: argparse.Namespace, console: Console) -> int:
    import sinew

    names = [method.name for method in sinew.methods()]
    if args.method not in names:
        raise SinewError(f"method: expected one of {', '.join(names)}, got {args.method!r}")
    jobs = plan_jobs(args.inputs, args.out)
    outcomes = []
    for job in console.progress(jobs, len(jobs), "Re-skinning"):
        outcome = _reskin(job, args.method, args.overwrite)
        if outcome.error is not None:
            console.complain(outcome.error)
        for reason in outcome.left_out:
            console.complain(f"{job.source}: left as it was: {reason}")
        outcomes.append(outcome)
    console.table(
        ("file", "meshes", "result"),
        [(str(o.job.source), str(o.meshes), _result(o)) for o in outcomes],
    )
    failures = sum(outcome.failed for outcome in outcomes)
    console.say(f"{len(outcomes) - failures} of {len(outcomes)} files re-skinned with {args.method}")
    return 1 if failures else 0


def _reskin(job: Job, method: str, overwrite: bool) -> Outcome:
    import bpy

    from ..blender import drive, evaluate, files

    outcome = Outcome(job)
    try:
        if job.target.exists() and not overwrite:
            raise SinewError(f"{job.target}: is there already; use --overwrite to replace it")
        files.open_file(job.source)
        meshes = drive.deformed_meshes(list(bpy.data.objects))
        if not meshes:
            raise SinewError(f"{job.source}: no mesh is deformed by an armature; nothing written")
        for obj in meshes:
            try:
                evaluate.use_method(obj, method)
                outcome.meshes += 1
            except SinewError as error:
                outcome.left_out.append(str(error))
        if not outcome.meshes:
            raise SinewError(f"{job.source}: {outcome.left_out.pop()}; nothing written")
        files.save_copy(job.source, job.target)
    except SinewError as error:
        outcome.error = str(error)
    return outcome


def _result(outcome: Outcome) -> str:
    if outcome.error is not None:
        return "failed"
    if outcome.left_out:
        return f"{outcome.job.target}, {len(outcome.left_out)} left as they were"
    return str(outcome.job.target)
