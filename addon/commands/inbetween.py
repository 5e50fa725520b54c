# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew inbetween`: writes copies of files whose bones move between their keyed poses by a method of
Sinew."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

from ..core.errors import SinewError, WrongUse
from ..jobs.inputs import Job, plan_jobs
from .arguments import add_copies, frame_step
from .console import Console
from .outcome import Outcome

HELP = """\
Writes a copy of each file in which every armature with keyed poses moves between them by the method chosen,
instead of by the F-curves of single channels. Inputs are never written to. A folder stands for all .blend
files below it.

The in-betweens are plain keys in a copy of the action, that any Blender plays; the action itself stays in the
file. Constraints and drivers act after the in-betweens, as always. Actions that are mixed with NLA strips or
have several layers, and bones whose curves have modifiers other than Cycles, keep their curves."""


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    import sinew

    parser = subparsers.add_parser(
        "inbetween",
        help="write copies of files whose bones move between keyed poses by a method of Sinew",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_copies(parser)
    names = ", ".join(sinew.interpolate.METHODS)
    parser.add_argument("--method", required=True, help=f"one of {names}")
    parser.add_argument(
        "--spline", action="store_true", help="a Catmull-Rom spline through the keyed poses, not key to key"
    )
    parser.add_argument(
        "--step",
        type=frame_step,
        default=1,
        metavar="FRAMES",
        help="from one baked key to the next (default: 1)",
    )
    return parser


@dataclass
class Inbetweened(Outcome):
    armatures: int = 0
    bones: int = 0


def run(args: argparse.Namespace, console: Console) -> int:
    import sinew

    if args.method not in sinew.interpolate.METHODS:
        names = ", ".join(sinew.interpolate.METHODS)
        raise WrongUse(f"method: expected one of {names}, got {args.method!r}")
    jobs = plan_jobs(args.inputs, args.out)
    outcomes = []
    for job in console.progress(jobs, len(jobs), "Making in-betweens"):
        outcome = _inbetween(job, args)
        outcome.complain(console)
        outcomes.append(outcome)
    console.table(
        ("file", "armatures", "bones", "result"),
        [(str(o.job.source), str(o.armatures), str(o.bones), o.result) for o in outcomes],
    )
    failures = sum(outcome.failed for outcome in outcomes)
    console.say(f"{len(outcomes) - failures} of {len(outcomes)} files with in-betweens by {args.method}")
    return 1 if failures else 0


def _inbetween(job: Job, args: argparse.Namespace) -> Inbetweened:
    import bpy

    from ..core import inbetween as core
    from ..features.inbetween import inbetween_bake
    from ..io import actions, files

    outcome = Inbetweened(job)
    path = core.SPLINE if args.spline else core.STRAIGHT
    try:
        if job.target.exists() and not args.overwrite:
            raise SinewError(f"{job.target}: is there already; use --overwrite to replace it")
        outcome.notes += files.open_file(job.source)
        armatures = [
            obj
            for obj in bpy.data.objects
            if obj.type == "ARMATURE" and obj.is_editable and actions.bone_curves(*actions.playing(obj))
        ]
        if not armatures:
            raise SinewError(f"{job.source}: no armature plays an action with keyed bones; nothing written")
        settings = inbetween_bake.Settings(args.method, path, args.step)
        for armature in armatures:
            found: list[inbetween_bake.Baked] = []
            try:
                for _share in inbetween_bake.steps(armature, settings, found):
                    pass
            except SinewError as error:
                outcome.left_out.append(str(error))
                continue
            outcome.armatures += 1
            outcome.bones += found[0].bones
            outcome.notes += found[0].notes(path)
        if not outcome.armatures:
            raise SinewError(f"{job.source}: {outcome.left_out.pop()}; nothing written")
        files.save_copy(job.source, job.target)
    except SinewError as error:
        outcome.error = str(error)
    return outcome
