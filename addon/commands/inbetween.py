# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew inbetween`: writes copies of files whose bones move between their keyed poses by a method of
Sinew."""

import argparse
from dataclasses import asdict, dataclass

from ..base.errors import SinewError
from ..base.options import read_options
from ..base.steps import result_of
from ..features.inbetween.interpolation import InbetweenOptions
from ..jobs.inputs import plan_jobs
from .arguments import add_copies, add_options
from .console import Console
from .outcome import Outcome, conclude, of_each

SUMMARY = "write copies of files whose bones move between keyed poses by a method of Sinew"
HELP = """\
Writes a copy of each file in which every armature with keyed poses moves between them by the method chosen,
instead of by the F-curves of single channels. Inputs are never written to. A folder stands for all .blend
files below it.

The in-betweens are plain keys in a copy of the action, that any Blender plays; the action itself stays in the
file. Constraints and drivers act after the in-betweens, as always. Actions that are mixed with NLA strips or
have several layers, and bones whose curves have modifiers other than Cycles, keep their curves."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_copies(parser)
    add_options(parser, InbetweenOptions)


@dataclass
class Inbetweened(Outcome):
    armatures: int = 0
    bones: int = 0


def run(args: argparse.Namespace, console: Console) -> int:
    jobs = plan_jobs(args.inputs, args.out)
    shown = console.progress(jobs, len(jobs), "Making in-betweens")
    outcomes = of_each(shown, Inbetweened, lambda outcome: _inbetween(outcome, args), args.overwrite, console)
    columns, done = ("armatures", "bones"), f"with in-betweens by {args.method}"
    return conclude(console, outcomes, columns, lambda o: (str(o.armatures), str(o.bones)), done)


def _inbetween(outcome: Inbetweened, args: argparse.Namespace) -> None:
    import bpy

    from ..features.inbetween import inbetween_bake
    from ..io import actions, files

    source, options = outcome.job.source, read_options(InbetweenOptions, args)
    armatures = [
        obj
        for obj in bpy.data.objects
        if obj.type == "ARMATURE" and obj.is_editable and actions.bone_curves(*actions.playing(obj))
    ]
    if not armatures:
        raise SinewError(f"{source}: no armature plays an action with keyed bones; nothing written")
    for armature in armatures:
        try:
            baked = result_of(inbetween_bake.steps(armature, **asdict(options)))
        except SinewError as error:
            outcome.left_out.append(str(error))
            continue
        outcome.armatures += 1
        outcome.bones += baked.bones
        outcome.notes += baked.notes(options.path)
    if not outcome.armatures:
        raise SinewError(f"{source}: {outcome.left_out.pop()}; nothing written")
    files.save_copy(source, outcome.job.target)
