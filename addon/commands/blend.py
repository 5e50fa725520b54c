# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew blend`: blends actions of an armature into a new one, in a copy of the file."""

from __future__ import annotations

import argparse
import json
from collections.abc import Generator
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core import interrupt
from ..core.errors import SinewError, WrongUse
from ..core.output import file_to_write
from .arguments import count
from .console import Console

if TYPE_CHECKING:
    import bpy

    from ..core.motion.blend import Settings
    from ..core.motion.clip import Clip
    from ..core.motion.timing import Weights
    from ..features.blend.blend_actions import Made

HELP = """\
Blends two or more actions of an armature, bone by bone, into a new action of plain keys, and writes a copy of
the file in which the armature plays it. FILE is never written to; the actions stay in the copy.

--clips adds the animations of BVH, glTF or FBX files whose bones have the same names and rest. Each action
has a weight; with --weights-from they go from those in the first frame to --weights in the last, and with
--weights-at from one share of the motion to the next. Aligned, the default, actions are brought to the same
moment of their motion by the distance of their poses, and cycles to the weighted mean of their lengths. The
root's steps over the ground are blended and added up.

--measure prints, for each action and the blend, how far feet slide while they are on the ground, how far the
root goes, and the angular acceleration of bones; and how much bones shrink under matrix_linear."""

# The names of core.motion.blend, as the options spell them.
ROOT_MOTIONS = {"travel": "travel", "in-place": "in_place", "keyed": "keyed"}


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    from ..core.motion.blend import METHODS

    parser = subparsers.add_parser(
        "blend",
        help="blend actions of an armature, such as a walk and a run, into a new action",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", type=Path, metavar="FILE", help=".blend, .glb, .gltf, .fbx or .bvh")
    parser.add_argument("--armature", metavar="NAME", help="which, where the file has several that are moved")
    parser.add_argument(
        "--actions",
        nargs="+",
        default=[],
        metavar="NAME",
        help="of the file (default, with --clips: the one that the armature plays)",
    )
    parser.add_argument(
        "--clips", nargs="+", default=[], type=Path, metavar="FILE", help="more, to be imported"
    )
    parser.add_argument(
        "--weights",
        nargs="+",
        type=float,
        metavar="W",
        help="one for each action, then for each clip (default: equal)",
    )
    parser.add_argument(
        "--weights-from",
        nargs="+",
        type=float,
        metavar="W",
        help="those of the first frame, if --weights are of the last",
    )
    parser.add_argument(
        "--weights-at",
        nargs="+",
        type=float,
        action="append",
        metavar="SHARE W",
        help="a share of the motion, from 0 to 1, and the weights there; several times, without --weights",
    )
    parser.add_argument(
        "--smooth",
        action="store_true",
        help="each change of weights begins and ends slowly (default: even)",
    )
    parser.add_argument("--method", default="dlb", help=f"one of {', '.join(METHODS)} (default: dlb)")
    parser.add_argument(
        "--space",
        choices=("relative", "armature"),
        default="relative",
        help="each bone relative to its parent, or by itself (default: relative)",
    )
    parser.add_argument(
        "--align",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="to the same moment of the motion, or each from its first frame at its own pace",
    )
    parser.add_argument(
        "--align-by", nargs="+", default=[], metavar="BONE", help="those that say the moment (default: all)"
    )
    parser.add_argument("--root", metavar="BONE", help="that carries the others (default: found)")
    parser.add_argument(
        "--root-motion",
        choices=tuple(ROOT_MOTIONS),
        default="travel",
        help="blended and added up, taken out, or blended as any bone's pose (default: travel)",
    )
    parser.add_argument(
        "--cycles", type=count, default=1, metavar="N", help="how often cycles go round (default: 1)"
    )
    parser.add_argument("--name", help="of the new action")
    parser.add_argument("--measure", action="store_true", help="print numbers of the actions and the blend")
    parser.add_argument(
        "--feet", nargs="+", metavar="BONE", help="of --measure (default: those that come to the ground)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--out",
        type=partial(file_to_write, endings=(".blend",)),
        metavar="NEW.blend",
        help="the copy; may be left out with --measure",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace NEW.blend where it exists already")
    return parser


def run(args: argparse.Namespace, console: Console) -> int:
    import bpy

    from ..io import clips, files

    out = _target(args)
    console.note_on(args.file, files.open_file(args.file, importers=clips.IMPORTERS))
    armature = _armature(args)
    chosen = _actions(args, armature)
    weights = _weights(args, len(chosen))
    made = _make(args, armature, chosen, weights, console)
    for note in made.notes():
        console.note(f"{args.file}: {note}")
    facts: dict[str, Any] = {
        "file": str(args.file),
        "armature": armature.name,
        "actions": [action.name for action in chosen],
        "action": made.action.name,
        "frames": made.frames,
        "is_cyclic": made.blend.is_cyclic,
        "root": made.blend.root,
        "notes": made.notes(),
    }
    if args.measure:
        scene = bpy.context.scene
        facts |= _measured(args, made, scene.render.fps / scene.render.fps_base)
    if out is not None:
        from ..features.blend import blend_actions

        blend_actions.play(armature, made.action)
        files.save_copy(args.file, out)
        facts["out"] = str(out)
    if args.json:
        console.say(json.dumps(facts, indent=2, ensure_ascii=False))
    else:
        _say(facts, console)
    return 0


def _target(args: argparse.Namespace) -> Path | None:
    out: Path | None = args.out
    if out is None:
        if not args.measure:
            raise WrongUse("sinew blend: expected --out NEW.blend, or --measure for numbers alone")
        return None
    if out.resolve() == args.file.resolve():
        raise WrongUse(f"{out}: would replace the file itself; choose another name")
    if out.exists() and not args.overwrite:
        raise SinewError(f"{out}: is there already; use --overwrite to replace it")
    return out


def _armature(args: argparse.Namespace) -> bpy.types.Object:
    import bpy

    found = {obj.name: obj for obj in bpy.data.objects if obj.type == "ARMATURE"}
    if args.armature is not None:
        if args.armature not in found:
            raise SinewError(
                f"{args.file}: has no armature {args.armature!r}; there are: {', '.join(found) or 'none'}"
            )
        return found[args.armature]
    # An armature that plays nothing is seldom meant.
    playing = {name: obj for name, obj in found.items() if obj.animation_data is not None}
    left = playing if len(playing) == 1 else found
    if len(left) != 1:
        there = f"there are: {', '.join(found)}; choose one by --armature" if found else "there is none"
        raise SinewError(f"{args.file}: expected one armature, {there}")
    return next(iter(left.values()))


def _actions(args: argparse.Namespace, armature: bpy.types.Object) -> list[bpy.types.Action]:
    import bpy

    from ..io import clips

    names = [a.name for a in bpy.data.actions if clips.keyed_properties(armature, a)]
    there = f"{armature.name} can play: {', '.join(names) or 'none'}"
    missing = [name for name in args.actions if name not in bpy.data.actions]
    if missing:
        raise SinewError(f"{args.file}: has no action {missing[0]!r}; {there}")
    chosen = [bpy.data.actions[name] for name in args.actions]
    animation = armature.animation_data
    if not chosen and args.clips and animation is not None and animation.action is not None:
        chosen.append(animation.action)
    for path in args.clips:
        chosen += clips.import_actions(armature, path)
    if len(chosen) < 2:
        raise WrongUse(f"sinew blend: expected two actions or more by --actions or --clips; {there}")
    return chosen


def _make(
    args: argparse.Namespace,
    armature: bpy.types.Object,
    chosen: list[bpy.types.Action],
    weights: Weights,
    console: Console,
) -> Made:
    from ..features.blend import blend_actions

    settings = _settings(args)
    steps = blend_actions.make(armature, chosen, weights, settings, args.name or "")
    with console.bar(f"Blending {len(chosen)} actions", len(chosen)) as show, closing(steps):
        return _shown(steps, show)


def _weights(args: argparse.Namespace, count: int) -> Weights:
    from ..core.motion.timing import Weights

    if args.weights_at is not None:
        if args.weights is not None or args.weights_from is not None:
            raise WrongUse("sinew blend: expected --weights-at or --weights, not both")
        keys = sorted(args.weights_at)
        return Weights.of([key[1:] for key in keys], count, [key[0] for key in keys], args.smooth)
    last = args.weights or [1.0] * count
    if args.weights_from is None:
        return Weights.of(last, count)
    return Weights.of((args.weights_from, last), count, smooth=args.smooth)


def _settings(args: argparse.Namespace) -> Settings:
    from ..core.motion.blend import Settings

    return Settings(
        method=args.method,
        space=args.space,
        align=args.align,
        align_bones=tuple(args.align_by),
        root=args.root,
        root_motion=ROOT_MOTIONS[args.root_motion],
        cycles=args.cycles,
    )


def _shown(steps: Generator[float, None, Made], show: Any) -> Made:
    while True:
        try:
            show(next(steps))
        except StopIteration as end:
            return end.value
        interrupt.check()


def _measured(args: argparse.Namespace, made: Made, frames_a_second: float) -> dict[str, Any]:
    import numpy as np

    from ..core.motion import measure

    up, rig = np.array(made.up), made.blend.rig
    first = made.sources[0]
    feet = measure.bones_named(first, args.feet) if args.feet else measure.feet_of(first, up)
    root = rig.index(made.blend.root) if made.blend.root is not None else 0

    def numbers(clip: Clip) -> dict[str, Any]:
        found = asdict(measure.measure(clip, feet, root, up, frames_a_second))
        return {"name": clip.name, "length": clip.length, **found}

    least = measure.shrinking(made.blend)
    return {
        "feet": [rig.names[bone] for bone in feet],
        "measures": [numbers(clip) for clip in (*made.sources, made.clip)],
        "shrinking": asdict(least),
    }


def _say(facts: dict[str, Any], console: Console) -> None:
    if "measures" in facts:
        columns = ("action", "frames", "sliding", "travel", "angular acceleration", "at most")
        rows = [
            (
                each["name"],
                f"{each['length']:g}",
                f"{each['sliding']:.4g}",
                f"{each['travel']:.4g}",
                f"{each['angular_acceleration']:,.0f}",
                f"{each['worst_acceleration']:,.0f}",
            )
            for each in facts["measures"]
        ]
        console.table(columns, rows)
        least = facts["shrinking"]
        console.say(
            f"sliding of {', '.join(facts['feet']) or 'no feet'} and travel a frame, degrees a second squared"
        )
        console.say(
            f"least volume {least['volume']:.3f}, of {least['bone']} in frame {least['frame'] + 1}; bones "
            f"leave their parents by {least['apart']:.3g}"
        )
    root = f", carried by {facts['root']}" if facts["root"] is not None else ""
    kind = "a cycle" if facts["is_cyclic"] else "no cycle"
    what = f"{facts['action']}: {facts['frames']} frames, {kind}{root}"
    console.say(f"{what}: {facts['out']}" if "out" in facts else what)
