# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew ik`: writes copies of files whose IK chains Sinew solves, or measures both solvers."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import SinewError, WrongUse
from ..core.frames import parse_frames
from ..core.output import folder_to_write
from ..jobs.inputs import Job, plan_jobs
from .console import Console
from .outcome import Outcome

HELP = """\
Writes a copy of each file in which bones that an inverse kinematics constraint pulls are keyed as Sinew
solves it: target, pole, chain length, weights, rotation, and the limits, locks and stiffness of the bones
are those of Blender's constraint, which the copy has muted. Inputs are never written to. A folder stands for
all .blend files below it. Constraints with stretch, and bones with other constraints, are refused, each with
a sentence.

With --compare nothing has to be written: for each chain how far the tip is from its goal (parts of the
chain's length), how smoothly the bones move (rms of their angular acceleration, radians per frame squared),
how many iterations it took and how long, by Blender and by each method of Sinew's."""


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    import sinew

    parser = subparsers.add_parser(
        "ik",
        help="write copies of files whose IK chains are solved by Sinew, or compare it with Blender's solver",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("inputs", nargs="+", metavar="FILE_OR_FOLDER")
    parser.add_argument("--out", type=folder_to_write, metavar="DIR", help="folder for the copies")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist already")
    parser.add_argument("--armature", metavar="NAME", help="only this armature object")
    parser.add_argument(
        "--bone",
        action="append",
        metavar="NAME",
        help="only chains with this bone; may be given several times",
    )
    parser.add_argument("--method", choices=sinew.ik.METHODS, default="dls", help="default: dls")
    parser.add_argument("--frames", metavar="FIRST-LAST", help="default: the scene's frames")
    parser.add_argument("--compare", action="store_true", help="measure Blender's solver and Sinew's")
    return parser


@dataclass
class Solved(Outcome):
    chains: int = 0
    bones: int = 0
    worst: float = 0.0


def run(args: argparse.Namespace, console: Console) -> int:
    if args.out is None and not args.compare:
        raise WrongUse("sinew ik: expected --out DIR, --compare, or both")
    frames = None if args.frames is None else _range(args.frames)
    jobs = plan_jobs(args.inputs, args.out or Path.cwd() / "sinew-ik")
    outcomes, rows = [], []
    for job in console.progress(jobs, len(jobs), "Solving inverse kinematics"):
        outcome = Solved(job)
        try:
            rows += _solve(job, outcome, args, frames)
        except SinewError as error:
            outcome.error = str(error)
        outcome.complain(console)
        outcomes.append(outcome)
    if args.compare:
        columns = ("file", "tip", "solver", "error rms", "error max", "iterations", "acceleration", "time")
        console.table(columns, rows)
        console.note(
            "Blender does not tell its iterations; its time is an update with less one without, by turns"
        )
    if args.out is not None:
        console.table(
            ("file", "chains", "bones", "farthest tip", "result"),
            [(str(o.job.source), str(o.chains), str(o.bones), f"{o.worst:.1e}", o.result) for o in outcomes],
        )
    failures = sum(outcome.failed for outcome in outcomes)
    console.say(f"{len(outcomes) - failures} of {len(outcomes)} files solved")
    return 1 if failures else 0


def _range(text: str) -> list[int]:
    frames = parse_frames(text)
    whole = sorted({int(frame) for frame in frames})
    if whole != frames or whole != list(range(whole[0], whole[-1] + 1)):
        raise WrongUse(f"frames: expected one range of whole frames such as 1-48, got {text!r}")
    return whole


def _solve(
    job: Job, outcome: Solved, args: argparse.Namespace, frames: list[int] | None
) -> list[tuple[str, ...]]:
    import bpy
    import sinew

    from ..features.ik import ik_bake, ik_compare
    from ..io import files, ik_io
    from ..ui import stepped

    if args.out is not None and job.target.exists() and not args.overwrite:
        raise SinewError(f"{job.target}: is there already; use --overwrite to replace it")
    outcome.notes += files.open_file(job.source)
    scene = bpy.context.scene
    armatures = [obj for obj in scene.objects if obj.type == "ARMATURE" and args.armature in (None, obj.name)]
    if not armatures:
        which = "no armature" if args.armature is None else f"no armature called {args.armature!r}"
        raise SinewError(f"{job.source}: {which}; nothing written")
    wanted = frames or stepped.frames_over(scene, armatures, "SCENE")
    rows: list[tuple[str, ...]] = []
    reasons = []
    for armature in armatures:
        with stepped.kept_frame(scene, [armature]):
            try:
                trees = ik_io.read_trees(armature, args.bone)
            except SinewError as error:
                reasons.append(str(error))
                continue
            if args.compare:
                for tree in trees:
                    measured = ik_compare.measure(armature, tree, wanted, sinew.ik.METHODS)
                    rows += [_row(job, each) for each in measured]
            if args.out is not None:
                found: list[ik_bake.Baked] = []
                for _share in ik_bake.steps(armature, trees, wanted, args.method, found):
                    pass
                outcome.worst = max([outcome.worst, *(float(each.errors.max()) for each in found)])
        outcome.chains += len(trees)
        outcome.bones += sum(len(tree.bones) for tree in trees)
    if not outcome.chains:
        raise SinewError(f"{job.source}: {reasons[0]}; nothing written")
    outcome.left_out += [reason for reason in reasons if "no inverse kinematics constraint" not in reason]
    if args.out is not None:
        files.save_copy(job.source, job.target)
    return rows


def _row(job: Job, measured: Any) -> tuple[str, ...]:
    tree = measured.tree
    iterations = "-" if np.isnan(measured.iterations) else f"{measured.iterations:.1f}"
    return (
        job.source.name,
        ", ".join(tree.bones[effector.bone] for effector in tree.effectors),
        measured.solver,
        f"{np.sqrt(np.mean(measured.errors**2)):.1e}",
        f"{np.max(measured.errors):.1e}",
        iterations,
        f"{measured.acceleration:.2e}",
        f"{measured.microseconds:.1f} ± {measured.spread:.1f} us",
    )
