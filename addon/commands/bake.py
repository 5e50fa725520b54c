# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew bake`: Sinew's deformation as data that plays in any Blender, and in other programs."""

from __future__ import annotations

import argparse
from contextlib import closing
from dataclasses import asdict, dataclass, field
from typing import Any

from ..base import interrupt
from ..base.errors import SinewError, WrongUse, about
from ..base.options import read_options
from ..features.bake.baked_files import FILES, FORMATS, KINDS, played_elsewhere
from ..features.bake.helper_bones import HelperOptions, Report
from ..features.bake.vat import VatOptions
from ..jobs.inputs import Job, plan_jobs
from .arguments import add_copies, add_frames, add_method, add_options, add_set, count
from .console import Console
from .outcome import Outcome, conclude, of_each, use_method

SUMMARY = "write what Sinew deforms as shape keys, point caches, Alembic, USD, helper bones or textures"
HELP = """\
Writes Sinew's deformation of every armature-deformed mesh as data that plays without it. Inputs are never
written to. A folder stands for all .blend files below it.

shape-keys  a .blend with one shape key a frame and keyed values
mdd, pc2    a .blend with a Mesh Cache modifier for each mesh, and its caches in a folder beside
alembic     an .abc of the final meshes, with UVs and materials
usd         a .usdc of the same
bones       a .blend whose armatures have helper bones with keys, and meshes with weights of all bones: linear
            blending, as every engine and glTF and FBX files have it, comes as near as the errors say;
            with --motion pose they have constraints instead, and follow other animation, too; n + 1 plain
            bones replace a bendy bone of n segments
vat         vertex animation textures of positions and normals, and a .glb of the meshes at rest, for shaders
            of engines

In a .blend the Armature modifiers stay, switched off (bones: on). Between frames that are not neighbours
shapes move in straight lines."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_copies(parser)
    add_method(parser, "a method of `sinew methods`, for all meshes (default: each as the file has it)")
    parser.add_argument("--to", required=True, choices=KINDS, help="what to write")
    add_frames(parser, "such as 1,12,40-48 (default: the scene's frames)")
    parser.add_argument("--step", type=count, default=1, metavar="N", help="every Nth of the frames")
    add_options(parser, HelperOptions, "bones: ")
    add_options(parser, VatOptions, "vat: ")
    parser.add_argument("--json", action="store_true", help="print JSON, with the errors of bones")
    add_set(parser)


@dataclass
class Baked(Outcome):
    meshes: int = 0
    frames: int = 0
    bones: list[Report] = field(default_factory=list)
    unit: str = ""

    def as_json(self) -> dict[str, Any]:
        return {
            "source": str(self.job.source),
            "file": None if self.error is not None else str(self.job.target),
            "meshes": self.meshes,
            "frames": self.frames,
            "errors": [self.error] if self.error is not None else self.left_out,
            "bones": [asdict(report) for report in self.bones],
        }


def run(args: argparse.Namespace, console: Console) -> int:
    if args.set and args.method is None:
        raise WrongUse(
            "--set goes with --method or --preset; without it meshes are baked as the file has them"
        )
    suffix = FILES.get(args.to, ".blend")
    jobs = [Job(job.source, job.target.with_suffix(suffix)) for job in plan_jobs(args.inputs, args.out)]
    outcomes = of_each(jobs, Baked, lambda outcome: _bake(outcome, args, console), args.overwrite, console)
    if args.json:
        console.say_json([outcome.as_json() for outcome in outcomes])
        return 1 if any(outcome.failed for outcome in outcomes) else 0
    for outcome in outcomes:
        for report in outcome.bones:
            for sentence in report.sentences(outcome.unit):
                console.note(f"{outcome.job.target}: {sentence}")
    columns = ("meshes", "frames")
    return conclude(console, outcomes, columns, lambda o: (str(o.meshes), str(o.frames)), "baked")


def _bake(outcome: Baked, args: argparse.Namespace, console: Console) -> None:
    import bpy

    from ..attach import attach, properties
    from ..deform import characters
    from ..features.bake import bake, bake_apart, bake_bones, bake_export
    from ..io import files

    source, target = outcome.job.source, outcome.job.target
    scene = bpy.context.scene
    meshes = attach.deformed_meshes(list(scene.objects))
    if not meshes:
        raise SinewError(f"{source}: no mesh is deformed by an armature; nothing written")
    other_scenes = [obj for obj in attach.deformed_meshes(list(bpy.data.objects)) if obj.library is None]
    outcome.left_out += [
        f"{obj.name} is not in the scene {scene.name}" for obj in other_scenes if obj not in meshes
    ]
    chosen = sorted(set(args.frames or range(scene.frame_start, scene.frame_end + 1)))[:: args.step]
    # Hidden objects are baked as well, and hidden again in the copy.
    with characters.shown(meshes):
        if args.method is not None:
            characters.set_parameters(args.set)
            taken, left_out = use_method(meshes, args.method)
        else:
            taken = [obj for obj in meshes if properties.has_sinew(obj) and properties.of(obj).enabled]
            others = [obj.name for obj in meshes if obj not in taken]
            left_out = [f"{name} is not deformed by Sinew; choose a method by --method" for name in others]
        outcome.left_out += left_out
        console.note_on(source, characters.sentences())
        if not taken:
            raise SinewError(f"{source}: {outcome.left_out.pop()}; nothing written")
        options = read_options(HelperOptions, args), read_options(VatOptions, args)
        with about(source):
            started = bake.start(taken, args.to, chosen, target, args.overwrite, *options)
        # An exporter writes all frames in one call, which cannot be interrupted and can crash on a full disk:
        # so it runs in a separate process.
        if isinstance(started, bake_export.SceneExport):
            shares = bake_apart.sample(started)
        else:
            shares = started.sample()
        with (
            about(source),
            started.whole_or_nothing(),
            console.bar(f"Baking {source.name}", len(chosen)) as show,
            closing(shares),
        ):
            for share in shares:
                show(share)
                interrupt.check()
            show(1.0)
    with about(source), started.whole_or_nothing():
        started.place()
        if args.to in FILES:
            started.publish()
        else:
            files.save_copy(source, target, started.publish)
    if args.to in FORMATS:
        console.note_on(target, [played_elsewhere(args.to, chosen)])
    outcome.meshes, outcome.frames = len(taken), len(chosen)
    if isinstance(started, bake_bones.BoneBake):
        outcome.bones, outcome.unit = started.reports, characters.length_unit(scene)
