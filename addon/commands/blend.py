# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew blend`: blends actions of an armature into a new one, in a copy of the file."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..base.errors import SinewError, WrongUse
from ..base.options import read_options
from ..base.steps import result_of
from ..features.blend.motion import Settings
from .arguments import add_file, add_options, file_named
from .console import Console

if TYPE_CHECKING:
    import bpy

    from ..features.blend.blend_actions import Made

SUMMARY = "blend actions of an armature, such as a walk and a run, into a new action"
HELP = """\
Blends two or more actions of an armature, bone by bone, into a new action of plain keys, and writes a copy of
the file in which the armature plays it. FILE is never written to; the actions stay in the copy.

Each action has a weight; with --weights-from they go from those in the first frame to --weights in the last.
Aligned, the default, actions are brought to the same moment of their motion by the distance of their poses,
and cycles to the weighted mean of their lengths. The root's steps on the ground are blended and added up."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument("--armature", metavar="NAME", help="which, where the file has several that are moved")
    parser.add_argument("--actions", nargs="+", required=True, metavar="NAME", help="two or more of the file")
    for name, text in (
        ("--weights", "one for each action (default: equal)"),
        ("--weights-from", "those of the first frame, if --weights are of the last"),
    ):
        parser.add_argument(name, nargs="+", type=float, metavar="W", help=text)
    add_options(parser, Settings)
    parser.add_argument("--name", default="", help="of the new action")
    parser.add_argument("--out", required=True, type=file_named(".blend"), metavar="NEW.blend")
    parser.add_argument("--overwrite", action="store_true", help="replace NEW.blend where it exists already")


def run(args: argparse.Namespace, console: Console) -> int:
    from ..io import actions, files

    if args.out.resolve() == args.file.resolve():
        raise WrongUse(f"{args.out}: would replace the file itself; choose another name")
    if args.out.exists() and not args.overwrite:
        raise SinewError(f"{args.out}: is there already; use --overwrite to replace it")
    console.note_on(args.file, files.open_file(args.file))
    armature = _armature(args)
    made = _make(args, armature, _actions(args, armature), console)
    console.note_on(args.file, made.notes())
    actions.play(armature, made.action)
    files.save_copy(args.file, args.out)
    root = f", carried by {made.blend.root}" if made.blend.root is not None else ""
    kind = "a cycle" if made.blend.is_cyclic else "no cycle"
    console.say(f"{made.action.name}: {made.frames} frames, {kind}{root}: {args.out}")
    return 0


def _armature(args: argparse.Namespace) -> bpy.types.Object:
    import bpy

    found = {obj.name: obj for obj in bpy.data.objects if obj.type == "ARMATURE"}
    there = ", ".join(found) or "none"
    if args.armature is not None:
        if args.armature not in found:
            raise SinewError(f"{args.file}: has no armature {args.armature!r}; there are: {there}")
        return found[args.armature]
    # An armature that plays nothing is seldom meant.
    playing = [obj for obj in found.values() if obj.animation_data is not None]
    left = playing if len(playing) == 1 else list(found.values())
    if len(left) != 1:
        raise SinewError(f"{args.file}: expected one armature, or --armature; there are: {there}")
    return left[0]


def _actions(args: argparse.Namespace, armature: bpy.types.Object) -> list[bpy.types.Action]:
    import bpy

    from ..features.blend import clips_io

    names = [a.name for a in bpy.data.actions if clips_io.keyed_properties(armature, a)]
    there = f"{armature.name} can play: {', '.join(names) or 'none'}"
    missing = [name for name in args.actions if name not in bpy.data.actions]
    if missing:
        raise SinewError(f"{args.file}: has no action {missing[0]!r}; {there}")
    chosen = [bpy.data.actions[name] for name in args.actions]
    if len(chosen) < 2:
        raise WrongUse(f"sinew blend: expected two actions or more; {there}")
    return chosen


def _make(
    args: argparse.Namespace, armature: bpy.types.Object, chosen: list[bpy.types.Action], console: Console
) -> Made:
    from ..features.blend import blend_actions

    settings = read_options(Settings, args)
    weights = args.weights or [1.0] * len(chosen)
    if args.weights_from is not None:
        weights = [args.weights_from, weights]
    steps = blend_actions.make(armature, chosen, weights, settings, args.name)
    with console.bar(f"Blending {len(chosen)} actions", len(chosen)) as show:
        return result_of(steps, show)
