# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew export`: writes a file for engines with Blender's own exporters, and verifies what it plays."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import TYPE_CHECKING

from ..base.errors import SinewError, WrongUse
from ..base.options import options_of, read_options
from ..base.phrases import Phrase
from ..features.gltf import players
from ..features.gltf.export_check import ENDINGS, FRAMES, Check, ExportOptions
from .arguments import add_file, add_frames, add_json, add_method, add_options, add_set, file_named, percent
from .console import Console
from .outcome import use_method

if TYPE_CHECKING:
    import bpy

SUMMARY = "write a .glb, .usdc or .fbx for engines, and say how far it plays from what is seen"
HELP = """\
Writes a .glb by Blender's own exporter: bones, weights and actions as ever, and in an extension and
attributes of each mesh that an armature deforms what an engine needs to skin it as Sinew does. A .usdc or
.fbx has bones, weights and animation alone. Plain bones replace bendy ones.

--verify reads the file again, without Blender's importers, plays it as an engine does, by linear blending,
and prints how far it is from what was seen; then each cause alone. The exit status is 1 where a difference
has no known cause, or is larger than --at-most.

--for chooses how many influences and which clips a player takes, unless they are given, and --verify then
says what was measured of it: docs/players.md."""


# Of ExportOptions.
_CHOSEN = ("influences", "clips")


def _player(text: str) -> str:
    try:
        return players.player(text)
    except WrongUse as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument("--out", required=True, type=file_named(*ENDINGS), metavar="OUT.glb")
    add_method(parser, "a method of `sinew methods`, for all meshes (default: each as the file has it)")
    parser.add_argument(
        "--for",
        dest="player",
        type=_player,
        metavar="NAME",
        help=f"one of {', '.join(players.PLAYERS)}: chooses what it plays best, and --verify adds what was "
        "measured of it",
    )
    add_options(parser, ExportOptions, chosen_by=dict.fromkeys(_CHOSEN, "--for plays best"))
    add_frames(parser, f"to verify, such as 1,12 (default: {FRAMES} of the scene's)")
    parser.add_argument(
        "--at-most",
        type=percent,
        metavar="PERCENT",
        help="with --verify: exit with 1 where a vertex is farther off, in percent of its mesh's diagonal",
    )
    add_json(parser)
    add_set(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    import bpy

    from ..attach import attach
    from ..deform import characters
    from ..features.gltf import export, export_file
    from ..io import files

    if not args.verify and (args.frames is not None or args.at_most is not None):
        raise WrongUse("--frames and --at-most go with --verify")
    ending = args.out.suffix.lower()
    _choose(args, ending)
    console.note_on(args.file, files.open_file(args.file))
    meshes = attach.deformed_meshes(list(bpy.context.scene.objects))
    options = read_options(ExportOptions, args, frames=args.frames)
    if args.player is None and ending == ".glb" and options.influences > players.FOUR:
        console.note(f"{args.out}: {players.more_than_four()}")
    of_player: list[Phrase] = []
    if args.player is not None and args.verify:
        influences = options.influences if ending == ".glb" else 0
        of_player = players.sentences(args.player, ending, influences, options.clips)
    elif args.player is not None and (warning := players.warning(args.player, ending)) is not None:
        console.note(f"{args.out}: {warning}")
    # Blender does not evaluate hidden objects.
    with characters.shown(meshes):
        left_out, skinned = _skinned(args, meshes, console)
        if ending == ".usdc":
            console.note_on(args.out, export_file.mirrored(skinned))
        written = export_file.write(args.out, skinned, options)
    left_out += written.left_out
    for sentence in left_out:
        console.complain(f"{args.file}: {sentence}")
    unit = characters.length_unit(bpy.context.scene)
    console.note_on(args.file, (report.sentence(unit) for report in written.bendy))
    for name, content in export.current.written.items() if ending == ".glb" else ():
        mixed = f", mixed with {content['mix']}" if "mix" in content else ""
        console.note(f"{name}: {content['method']}{mixed}")
    if args.json:
        said: dict[str, object] = {"file": str(args.out), "unit": unit, "errors": left_out}
        said |= {"bendy": [asdict(each) for each in written.bendy]}
        said |= {"meshes": [{**asdict(c), "explained": c.is_explained} for c in written.checks]}
        said |= {"player": of_player} if of_player else {}
        console.say_json(said)
    else:
        for check in written.checks:
            for sentence in check.sentences(unit):
                console.say(f"{check.mesh}: {sentence}")
        for sentence in of_player:
            console.say(sentence)
        console.say(str(args.out))
    return 1 if left_out or any(_is_too_far(check, args.at_most) for check in written.checks) else 0


def _choose(args: argparse.Namespace, ending: str) -> None:
    """Gives options that are not given a value. Raises WrongUse for a file that the player does not read."""
    best = {name: options_of(ExportOptions)[name][0] for name in _CHOSEN}
    if args.player is not None:
        players.check_ending(args.player, ending)
        best |= players.best_options(args.player)
    for name in _CHOSEN:
        if getattr(args, name) is None:
            setattr(args, name, best[name])


def _skinned(
    args: argparse.Namespace, meshes: list[bpy.types.Object], console: Console
) -> tuple[list[str], list[bpy.types.Object]]:
    """Has the meshes deformed by the method chosen. Returns a sentence for each that is not, and those that
    Sinew deforms."""
    from ..attach import properties
    from ..deform import characters

    left_out: list[str] = []
    if args.method is not None:
        characters.set_parameters(args.set)
        _taken, left_out = use_method(meshes, args.method)
        console.note_on(args.file, characters.sentences())
    skinned = [obj for obj in meshes if properties.has_sinew(obj) and properties.of(obj).enabled]
    if not skinned:
        reason = left_out[0] if left_out else "no mesh has Sinew; choose a method by --method"
        raise SinewError(f"{args.file}: {reason}")
    return left_out, skinned


def _is_too_far(check: Check, percent_of_diagonal: float | None) -> bool:
    if percent_of_diagonal is None:
        return not check.is_explained
    return not check.is_explained or check.total.largest > percent_of_diagonal / 100.0 * check.diagonal
