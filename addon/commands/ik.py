# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew ik`: writes copies of files whose IK chains Sinew solves."""

import argparse
from dataclasses import dataclass

from ..base.errors import SinewError, WrongUse
from ..base.frames import parse_frames
from ..base.steps import result_of
from ..jobs.inputs import plan_jobs
from .arguments import add_copies
from .console import Console
from .outcome import Outcome, conclude, of_each

SUMMARY = "write copies of files whose IK chains are solved by Sinew"
HELP = """\
Writes a copy of each file in which bones that an inverse kinematics constraint pulls are keyed as Sinew
solves it: target, pole, chain length, weights, rotation, and the limits, locks and stiffness of the bones
are those of Blender's constraint, which the copy has muted. Inputs are never written to. A folder stands for
all .blend files below it. Constraints with stretch, and bones with other constraints, are refused, each with
a sentence."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_copies(parser)
    parser.add_argument("--armature", metavar="NAME", help="only this armature object")
    parser.add_argument(
        "--bone",
        action="append",
        metavar="NAME",
        help="only chains with this bone; may be given several times",
    )
    parser.add_argument("--frames", type=_range, metavar="FIRST-LAST", help="default: the scene's frames")


@dataclass
class Solved(Outcome):
    chains: int = 0
    bones: int = 0
    worst: float = 0.0


def run(args: argparse.Namespace, console: Console) -> int:
    jobs = plan_jobs(args.inputs, args.out)
    shown = console.progress(jobs, len(jobs), "Solving inverse kinematics")
    outcomes = of_each(shown, Solved, lambda solved: _solve(solved, args), args.overwrite, console)
    columns = ("chains", "bones", "farthest tip")
    return conclude(
        console, outcomes, columns, lambda o: (str(o.chains), str(o.bones), f"{o.worst:.1e}"), "solved"
    )


def _range(text: str) -> list[int]:
    frames = parse_frames(text)
    whole = sorted({int(frame) for frame in frames})
    if whole != frames or whole != list(range(whole[0], whole[-1] + 1)):
        raise WrongUse(f"frames: expected one range of whole frames such as 1-48, got {text!r}")
    return whole


def _solve(outcome: Solved, args: argparse.Namespace) -> None:
    import bpy

    from ..features.ik import ik_bake
    from ..io import files, ik_io
    from ..ui import stepped

    source, scene = outcome.job.source, bpy.context.scene
    armatures = [obj for obj in scene.objects if obj.type == "ARMATURE" and args.armature in (None, obj.name)]
    if not armatures:
        which = "no armature" if args.armature is None else f"no armature called {args.armature!r}"
        raise SinewError(f"{source}: {which}; nothing written")
    wanted = args.frames or stepped.frames_over(scene, armatures, "SCENE")
    reasons = []
    for armature in armatures:
        with stepped.kept_frame(scene, [armature]):
            try:
                trees = ik_io.read_trees(armature, args.bone)
            except SinewError as error:
                reasons.append(str(error))
                continue
            found = result_of(ik_bake.steps(armature, trees, wanted))
        outcome.worst = max([outcome.worst, *(float(each.errors.max()) for each in found)])
        outcome.chains += len(trees)
        outcome.bones += sum(len(tree.bones) for tree in trees)
    if not outcome.chains:
        raise SinewError(f"{source}: {reasons[0]}; nothing written")
    outcome.left_out += [reason for reason in reasons if "no inverse kinematics constraint" not in reason]
    files.save_copy(source, outcome.job.target)
