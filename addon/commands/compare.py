# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew compare`: writes a page for each file that shows and measures methods side by side."""

from __future__ import annotations

import argparse
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from ..base.errors import SinewError, WrongUse
from ..base.names import as_file_name
from ..base.output import folder_to_write, write_text
from ..base.steps import result_of
from ..features.measure.comparison import USUAL_METHODS, Comparison, RestFacts
from ..features.measure.diagnostics import USUAL_INFLUENCES
from ..features.pages.page import page
from ..features.pages.templates import require_jinja
from ..skinning.parameters import PRESETS
from ..skinning.variants import SYNTAX, USUAL, Variant, parse_list, title_of
from .arguments import (
    add_engine,
    add_files,
    add_frames,
    add_object,
    add_set,
    add_viewer,
    check_viewer,
    count_or_none,
    file_named,
    pixels,
    variants,
)
from .console import Console

if TYPE_CHECKING:
    import bpy

    from ..features.measure.subjects import Subject
    from ..features.pages.viewer import Variants


SHEET = f"blender, {USUAL}, recommended"
SUMMARY = "show and measure methods beside each other"
HELP = (
    "Writes DIR/NAME.html for each file, a page that needs nothing else: pictures of the "
    "worst frames under each method with one camera, heat maps, close-ups of the worst places, plots "
    "over the frames, diagnostics of the weights. Beside it DIR/NAME/ with metrics.json and "
    "the pictures. --viewer writes a page in which the character moves and turns; with --sheet one of its "
    "range of motion, in which a click on a picture of the sheet goes there."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    parser.add_argument(
        "--methods",
        help="of `sinew methods`, recommended, and blender for the Armature modifier (default: "
        f"{','.join(USUAL_METHODS)})",
    )
    parser.add_argument(
        "--variants",
        type=variants,
        metavar="VARIANTS",
        help=f"in the place of --methods, divided by commas: {SYNTAX}",
    )
    parser.add_argument(
        "--reference",
        default="blender",
        metavar="METHOD",
        help="what distances are measured to (default: %(default)s, the file's Armature modifier)",
    )
    add_frames(parser, "such as 1,12,40-48 (default: the file's frame range)")
    add_object(parser)
    parser.add_argument(
        "--pictures",
        type=count_or_none,
        default=4,
        metavar="N",
        help="most frames to draw, of those at which a measure is worst; 0: none (default: %(default)s)",
    )
    parser.add_argument(
        "--influences",
        type=count_or_none,
        default=USUAL_INFLUENCES,
        metavar="N",
        help="how many bones a vertex may have before it is reported (default: %(default)s)",
    )
    parser.add_argument(
        "--size", type=pixels, help="pixels of each picture (default: 480; 240 of a contact sheet)"
    )
    add_engine(parser)
    parser.add_argument("--out", type=folder_to_write, metavar="DIR", help="folder for the pages")
    add_viewer(
        parser,
        "write a page in which the character of the file moves and turns in the browser; without --out it "
        "alone",
    )
    parser.add_argument(
        "--sheet",
        type=file_named(".png"),
        metavar="SHEET.png",
        help="write a contact sheet: the joints of the character bent in stated poses, a row for each "
        f"variant (default: {SHEET})",
    )
    parser.add_argument(
        "--difference",
        action="store_true",
        help="of a contact sheet: colour all rows after the first by how far each place is from the first",
    )
    add_set(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    from ..deform import characters
    from ..features.pages import render

    if args.sheet is not None:
        return _run_sheet(args, console)
    if args.difference:
        raise WrongUse("--difference colours a contact sheet: it goes with --sheet")
    named = USUAL_METHODS if args.methods is None else args.methods.split(",")
    methods = list(dict.fromkeys(name.strip() for name in named))
    characters.check_methods([*methods, args.reference], PRESETS)
    _check_variants(args)
    characters.set_parameters(args.set)
    if args.out is None and args.viewer is None:
        raise WrongUse("expected --out, --viewer or both; or --sheet")
    check_viewer(args.viewer, len(args.files))
    if args.out is not None:
        require_jinja()
    _check_names(args.files)
    engine = render.chosen_engine(args.engine) if args.pictures and args.out is not None else None
    failed = False
    for path in args.files:
        try:
            complete = True
            if args.viewer is not None:
                write = _write_viewer if args.variants is None else _write_viewer_of_variants
                complete = write(path, methods, args, console)
            if args.out is not None:
                complete &= _compare(path, methods, engine, args, console)
        except SinewError as error:
            console.complain(error)
            complete = False
        failed |= not complete
    return 1 if failed else 0


def _run_sheet(args: argparse.Namespace, console: Console) -> int:
    given = {"--out": args.out, "--methods": args.methods, "--frames": args.frames}
    for option in (option for option, value in given.items() if value is not None):
        raise WrongUse(f"--sheet: {option} does not go with it; --variants names its rows")
    if len(args.files) > 1:
        raise WrongUse(f"{args.sheet}: --sheet writes the sheet of a single file")
    _check_variants(args)
    try:
        return 0 if _write_sheet(args.files[0], args, console) else 1
    except SinewError as error:
        console.complain(error)
        return 1


def _write_sheet(path: Path, args: argparse.Namespace, console: Console) -> bool:
    """Returns False where a mesh was left out."""
    import bpy

    from ..deform import characters
    from ..features.pages import contact_sheet, motion_page, sheet_picture
    from ..features.pages.pictures import write_picture
    from ..features.pages.sheet import Sheet
    from ..io import files

    console.note_on(path, files.open_file(path))
    variants = args.variants or parse_list(SHEET)
    found = characters.deformed_meshes_of(bpy.context.scene, path, args.object)
    own = {each: characters.own_variants(found, each) for each in variants}
    meshes, left_out = characters.taken(found, path, ["dq"])
    for reason in left_out:
        console.complain(f"{path}: left out: {reason}")
    rows = {each: characters.with_presets(own[each]) for each in variants}
    if args.variants is None:
        rows = _without_repeats(rows)
    console.note_on(path, characters.sentences())
    joints, size = contact_sheet.columns(meshes), args.size or contact_sheet.SIZE
    labels = [title_of(each, row.values()) for each, row in rows.items()]
    sheet = Sheet(path.stem, labels, contact_sheet.headings(joints), is_difference=args.difference)
    count = len(rows) * len(joints)
    for cell in console.progress(
        contact_sheet.cells(joints, list(rows.values()), size), count, f"Drawing {path.name}"
    ):
        sheet.add(cell)
    ticks = contact_sheet.ticks(bpy.context.scene, sheet.scale)
    write_picture(args.sheet, sheet_picture.compose(sheet, size, ticks))
    console.say(str(args.sheet))
    if args.viewer is not None:
        of_keys = {each.key: row for each, row in rows.items()}
        steps = motion_page.page(bpy.context.scene, sheet, joints, of_keys, size, left_out)
        _save_page(steps, f"Posing {path.name}", len(joints), args.viewer, console)
    return not left_out


def _without_repeats(
    rows: Mapping[Variant, dict[bpy.types.Object, Variant]],
) -> dict[Variant, dict[bpy.types.Object, Variant]]:
    """Leaves out what a preset is, too."""
    presets = [row for variant, row in rows.items() if variant.method in PRESETS]

    def is_repeated(row: Mapping[bpy.types.Object, Variant]) -> bool:
        return any(all(own.agrees_with(of[obj]) for obj, own in row.items()) for of in presets)

    return {each: row for each, row in rows.items() if each.method in PRESETS or not is_repeated(row)}


def _check_variants(args: argparse.Namespace) -> None:
    if args.variants is None:
        return
    others = {
        "--methods": args.methods is not None,
        "--set": bool(args.set),
    }
    for option in (option for option, is_given in others.items() if is_given):
        raise WrongUse(f"--variants names whole choices, which {option} does not take; leave one away")


def _check_names(files: list[Path]) -> None:
    known: dict[str, Path] = {}
    for path in files:
        other = known.setdefault(path.stem, path)
        if other is not path:
            raise WrongUse(f"{other} and {path} would both be written to {path.stem}.html")


def _write_viewer(path: Path, methods: list[str], args: argparse.Namespace, console: Console) -> bool:
    """Writes the page that turns; returns False where a mesh was left out."""
    import bpy

    from ..attach import properties
    from ..deform import characters
    from ..features.pages import viewer
    from ..io import files

    console.note_on(path, files.open_file(path))
    scene = bpy.context.scene
    # The painted mix is that of the file.
    own = {obj: properties.of(obj).method for obj in scene.objects if properties.has_sinew(obj)}
    meshes, left_out = characters.deformable_meshes(scene, path, [*methods, viewer.PLAYED], args.object)
    preset = next((name for name in methods if name in PRESETS), None)
    errors = characters.use_methods([(obj, preset or own.get(obj, viewer.PLAYED)) for obj in meshes])
    left_out += [str(error) for error in errors if error is not None]
    console.note_on(path, characters.sentences() if preset else ())
    # Its stages follow all methods of the page.
    chosen = [properties.of(obj).method for obj in meshes]
    methods = list(
        dict.fromkeys(each for name in methods for each in (chosen if name in PRESETS else [name]))
    )
    return _write_page(path, meshes, methods, left_out, args, console)


def _write_viewer_of_variants(
    path: Path, _methods: list[str], args: argparse.Namespace, console: Console
) -> bool:
    """The same for variants, which have stages of their own."""
    import bpy

    from ..deform import characters
    from ..features.pages import viewer
    from ..io import files

    console.note_on(path, files.open_file(path))
    scene = bpy.context.scene
    found = characters.deformed_meshes_of(scene, path, args.object)
    own = {each: characters.own_variants(found, each) for each in args.variants}
    meshes, left_out = characters.taken(found, path, [viewer.PLAYED])
    rows = {
        each.key: characters.with_presets({obj: variants[obj] for obj in meshes})
        for each, variants in own.items()
    }
    console.note_on(path, characters.sentences())
    return _write_page(path, meshes, list(rows), left_out, args, console, rows)


def _write_page(
    path: Path,
    meshes: Sequence[bpy.types.Object],
    methods: list[str],
    left_out: list[str],
    args: argparse.Namespace,
    console: Console,
    variants: Variants = MappingProxyType({}),
) -> bool:
    """Of the open file; variants as of viewer.page(). Returns False where a mesh was left out."""
    import bpy

    from ..features.pages import viewer

    scene = bpy.context.scene
    frames = args.frames or list(range(scene.frame_start, scene.frame_end + 1))
    attached = viewer.attached_to(scene, meshes)
    of_each = dict.fromkeys(meshes, ())
    steps = viewer.page(scene, path.stem, of_each, attached, methods, frames, left_out, variants=variants)
    for reason in left_out:
        console.complain(f"{path}: left out: {reason}")
    _save_page(steps, f"Reading {path.name}", len(frames), args.viewer, console)
    return not left_out


def _save_page(
    steps: Generator[float, None, str], doing: str, count: int, page_to: Path, console: Console
) -> None:
    with console.bar(doing, count) as show:
        text = result_of(steps, show)
    write_text(page_to, text)
    console.say(str(page_to))


def _compare(
    path: Path, methods: list[str], engine: str | None, args: argparse.Namespace, console: Console
) -> bool:
    """Measures, and draws pictures; writes both, and one file's page. Returns False where a mesh was left
    out."""
    import bpy

    from ..deform import characters
    from ..features.measure import subjects
    from ..features.pages import illustrate, render
    from ..io import files

    console.note_on(path, files.open_file(path))
    scene = bpy.context.scene
    frames = args.frames or list(range(scene.frame_start, scene.frame_end + 1))
    characters.set_frame(scene, frames[0])
    found = characters.deformed_meshes_of(scene, path, args.object)
    own = {each.key: characters.own_variants(found, each) for each in args.variants or ()}
    methods = list(own) or methods
    named = {each.method for of_meshes in own.values() for each in of_meshes.values()} or methods
    meshes, left_out = characters.taken(found, path, [*named, args.reference])
    for reason in left_out:
        console.complain(f"{path}: left out: {reason}")
    subject = subjects.gather(scene, meshes)
    folder, sheets = args.out / as_file_name(path.stem), []
    with characters.kept_choices(meshes, [*named, args.reference], own):
        console.note_on(path, characters.sentences())
        comparison = _measure(path, subject, _labels(methods, args), frames, args, console)
        write_text(folder / "metrics.json", comparison.to_json())
        if engine is not None:
            studio = render.Studio(scene, subject.meshes, engine, args.size or 480)
            illustrator = illustrate.Illustrator(subject, comparison, studio, folder / "pictures")
            illustrator.plan(args.pictures)
            count = illustrator.picture_count
            for _ in console.progress(illustrator.draw(), count, f"Drawing {path.name}"):
                pass
            sheets = illustrator.sheets
    target = args.out / f"{path.stem}.html"
    write_text(target, page(comparison, sheets, "; ".join(f"Left out: {reason}" for reason in left_out)))
    console.say(str(target))
    return not left_out


def _labels(methods: list[str], args: argparse.Namespace) -> dict[str, str]:
    """By the names of methods, or by the keys of variants."""
    from ..attach import properties

    if args.variants is None:
        return {name: properties.method_label(name) for name in methods}
    return {each.key: each.title for each in args.variants}


def _measure(
    path: Path,
    subject: Subject,
    labels: dict[str, str],
    frames: list[float],
    args: argparse.Namespace,
    console: Console,
) -> Comparison:
    from ..deform import characters
    from ..features.measure import subjects
    from ..features.measure.stray_weights import stray_weights

    methods = list(labels)
    batches = subjects.batches(subject, frames, len(methods) + 1)
    measured = subjects.Measurements.of(methods)
    rest: RestFacts | None = None
    for batch in console.progress(batches, len(batches), f"Measuring {path.name}"):
        subjects.measure(subject, methods, args.reference, batch, measured)
        rest = rest or RestFacts.of(subject.gauge)
    assert rest is not None, "there is at least one frame"
    stray = stray_weights([part.edited for part in subject.parts])
    return Comparison(
        path.name,
        [obj.name for obj in subject.meshes],
        labels,
        args.reference,
        characters.length_unit(subject.scene),
        rest,
        frames,
        measured.summaries,
        measured.times,
        measured.own,
        {
            part.obj.name: [*own, *part.edited.findings(args.influences)]
            for part, own in zip(subject.parts, stray, strict=True)
        },
    )
