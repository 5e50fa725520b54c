# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew render`: renders frames under one method, and compares them with golden pictures."""

import argparse
from collections.abc import Mapping
from pathlib import Path

from ..base.errors import SinewError, WrongUse
from ..base.output import folder_to_write, remove, write_text
from ..skinning.parameters import PRESETS, Value, as_texts, parse
from .arguments import add_engine, add_file, add_frames, add_method, add_object, add_set, pixels
from .console import Console
from .golden import SETTINGS, RenderSettings, difference, difference_picture, differing_share, picture_name

# In percent of the pixels; between Blender 4.2 and 5.2 on one machine, no pixel differs.
USUAL_TOLERANCE = 0.05


SUMMARY = "draw frames under one method, and compare them with golden pictures"
HELP = (
    "Draws the armature-deformed meshes of a file in clay, a picture a frame, into DIR, with "
    "render.json that says how. With --against it does the same again (camera, engine, size and, where "
    "not given, method, --set and frames are those of the golden pictures) and compares each frame; the "
    "exit status is 1 where one differs by more than the tolerance."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_file(parser)
    text = "a method of `sinew methods`, or blender for the Armature modifier"
    add_method(parser, text, read=str)
    add_frames(parser)
    add_object(parser)
    parser.add_argument("--size", type=pixels, help="pixels of a picture's longer side (default: 640)")
    add_engine(parser, default=None)
    parser.add_argument(
        "--own-look",
        action="store_true",
        help="the file's own camera, lights, materials and render settings in the place of clay",
    )
    parser.add_argument("--against", type=Path, metavar="DIR", help="golden pictures to compare with")
    parser.add_argument(
        "--tolerance",
        type=float,
        default=USUAL_TOLERANCE,
        metavar="PERCENT",
        help="how many of the pixels may differ visibly (default: %(default)s percent)",
    )
    parser.add_argument(
        "--out", required=True, type=folder_to_write, metavar="DIR", help="folder for the pictures"
    )
    add_set(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    from ..deform import characters

    if not args.tolerance >= 0.0:
        raise WrongUse(f"tolerance: expected a percentage of 0 or more, got {args.tolerance}")
    golden = None
    if args.against is not None:
        if args.against.resolve() == args.out.resolve():
            raise WrongUse(f"{args.out}: would replace the golden pictures; choose another --out")
        golden = RenderSettings.read(args.against)
    method = args.method or (golden.method if golden is not None else None)
    frames = args.frames or (golden.frames if golden is not None else None)
    if method is None or frames is None:
        raise WrongUse("render: --method or --preset, and --frames, are needed where there is no --against")
    if method not in PRESETS:
        characters.check_methods([method])
    parameters = {**parse(golden.set), **args.set} if golden is not None else args.set
    characters.set_parameters(parameters)
    if golden is not None:
        _check_fits(args, golden, frames)
    _check_free(args.out, frames)
    _draw(args, method, frames, parameters, golden, console)
    console.say(f"{len(frames)} picture{'s' if len(frames) > 1 else ''} in {args.out}")
    return _judge(args, frames, console) if golden is not None else 0


def _check_fits(args: argparse.Namespace, golden: RenderSettings, frames: list[float]) -> None:
    missing = [frame for frame in frames if frame not in golden.frames]
    if missing:
        raise WrongUse(f"{args.against}: has no picture of frame {missing[0]}; make the golden ones anew")
    for name, wanted in (("size", golden.size), ("engine", golden.engine)):
        if getattr(args, name) not in (None, "auto", wanted):
            raise WrongUse(f"{name}: the golden pictures have {wanted}, got {getattr(args, name)}")
    if args.own_look != golden.own_look:
        raise WrongUse(
            f"{args.against}: was made with{'' if golden.own_look else 'out'} --own-look; do the same here"
        )


def _check_free(out: Path, frames: list[float]) -> None:
    """Raises SinewError where files with these names exist that `sinew render` did not make: other programs
    use names such as 0001.png, too."""
    if (out / SETTINGS).exists():
        return
    for frame in frames:
        path = out / picture_name(frame)
        if path.exists():
            raise SinewError(f"{path}: is there already, and not of `sinew render`; choose another --out")


def _draw(
    args: argparse.Namespace,
    method: str,
    frames: list[float],
    parameters: Mapping[str, Value],
    golden: RenderSettings | None,
    console: Console,
) -> None:
    import bpy

    from ..deform import characters
    from ..features.pages import render
    from ..io import files

    size = args.size or (golden.size if golden else 640)
    console.note_on(args.file, files.open_file(args.file))
    scene = bpy.context.scene
    characters.set_frame(scene, frames[0])
    meshes, left_out = characters.deformable_meshes(scene, args.file, [method], args.object)
    if left_out:
        raise SinewError(f"{args.file}: {left_out[0]}")
    characters.use_method_on(meshes, method)
    studio: render.Studio | None = None
    if args.own_look:
        render.use_own_look(scene, args.file)
        engine, views = scene.render.engine, []
    else:
        engine = render.chosen_engine(golden.engine if golden else args.engine or "auto")
        if golden is not None:
            views = [golden.views[golden.frames.index(frame)] for frame in frames]
        else:
            views = render.whole_views(meshes, [method], frames)
        studio = render.Studio(scene, meshes, engine, size)
    console.note_on(args.file, characters.sentences())
    names = [obj.name for obj in meshes]
    settings = RenderSettings(
        args.file.name, method, frames, engine, size, args.own_look, names, views, as_texts(parameters)
    )
    # Written first: it marks the pictures as made by this command, even if that is interrupted.
    write_text(args.out / SETTINGS, settings.to_json())
    for index, frame in enumerate(console.progress(frames, len(frames), f"Drawing {args.file.name}")):
        characters.set_frame(scene, frame)
        path = args.out / picture_name(frame)
        if studio is None:
            render.draw(scene, path)
        else:
            studio.picture(views[index], path)


def _judge(args: argparse.Namespace, frames: list[float], console: Console) -> int:
    """Compares pictures, prints a table, draws the differences; returns the exit status."""
    from ..features.pages import pictures

    rows, failures = [], 0
    for frame in frames:
        name = picture_name(frame)
        drawn = pictures.read_picture(args.out / name)
        golden = pictures.read_picture(args.against / name)
        shown = args.out / f"{Path(name).stem}.difference.png"
        remove(shown)
        if drawn.shape != golden.shape:
            failures += 1
            (height, width), (golden_height, golden_width) = drawn.shape[:2], golden.shape[:2]
            result = f"{width} x {height} pixels, not {golden_width} x {golden_height}"
            rows.append((str(frame), "", result))
            continue
        differences = difference(drawn, golden)
        percent = 100.0 * differing_share(differences)
        passed = percent <= args.tolerance
        if not passed:
            failures += 1
            pictures.write_picture(shown, difference_picture(differences, golden))
        rows.append((str(frame), f"{percent:.3f} %", "as before" if passed else str(shown)))
    console.table(("frame", "pixels that differ", "result"), rows)
    same = len(frames) - failures
    console.say(f"{same} of {len(frames)} pictures within {args.tolerance:g} % of {args.against}")
    return 1 if failures else 0
