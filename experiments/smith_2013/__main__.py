# SPDX-License-Identifier: GPL-3.0-or-later
"""Repeats the experiments of Smith 2013, on one page: `./dev report`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import sinew
from sinew_addon.base.errors import SinewError, WrongUse
from sinew_addon.base.output import folder_to_write
from sinew_addon.base.scratch import scratch_folder
from sinew_addon.commands.arguments import add_engine
from sinew_addon.prepare import leave_blender, prepare_blender

from . import answers, joints, measure, meshes, page, paper, paths, studies, tables
from .model import Figure, Page

PICTURE_SIZE, QUICK_PICTURE_SIZE = 520, 64
NO_FILES = "Not drawn: it takes report_links.blend and report_mesh.blend, which ./dev report passes on."


def parse(argv: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./dev report",
        description="Writes FOLDER/report.html, which needs no other file, and report.json: Tables 3.1 "
        "to 3.10 and Figures 3.3 to 3.11 of Smith 2013, each with the printed values, Sinew's and whether "
        "they agree. The page says what was left out and why. --results also writes the best five results "
        "as a short page for a site, of a whole report.json.",
    )
    parser.add_argument(
        "--out", type=folder_to_write, metavar="FOLDER", help="of report.html and report.json"
    )
    parser.add_argument(
        "--results",
        type=folder_to_write,
        metavar="FOLDER",
        help="of results.md, its plots (with matplotlib) and the numbers that they are made of",
    )
    parser.add_argument(
        "--from",
        dest="made",
        type=Path,
        metavar="FILE",
        help="the report.json that --results are of: nothing is measured",
    )
    parser.add_argument(
        "--programs",
        type=Path,
        metavar="FOLDER",
        help="operation_counts and timings_*, as ./dev report builds them",
    )
    parser.add_argument(
        "--blend-files", type=Path, metavar="FOLDER", help="Sinew's example rigs (blend_files/ of a checkout)"
    )
    add_engine(parser)
    parser.add_argument(
        "--quick",
        action="store_true",
        help="seconds instead of minutes: times that say nothing, small pictures",
    )
    return parser.parse_args(argv)


def run(args: argparse.Namespace) -> None:
    made = args.made
    if made is not None and (args.out is not None or args.results is None):
        raise WrongUse("--from takes --results FOLDER, and no --out")
    if made is None:
        if args.out is None:
            raise WrongUse("--out FOLDER is missing: where to write report.html and report.json")
        _make(args)
        made = args.out / "report.json"
    if args.results is not None:
        content = paper.read(made)
        for path in paper.write(content, args.results):
            print(path)


def _make(args: argparse.Namespace) -> None:
    """Writes report.html and report.json."""
    for folder in (args.programs, args.blend_files):
        if folder is not None and not folder.is_dir():
            raise SinewError(f"{folder}: no such folder")
    measurements = None
    if args.programs is not None:
        measurements = measure.measure(args.programs, args.quick, _note)
    _note("Computing Figures 3.3 to 3.5")
    plots = (joints.figure_3_3(), paths.figure_3_4(), paths.figure_3_5())
    pictures = meshes.missing(NO_FILES) if args.blend_files is None else _draw(args)
    figures = (*plots, *pictures)
    build = {} if measurements is None else measurements.build
    content = Page(
        version=sinew.__version__,
        machine={**measure.machine(), **build},
        quick=args.quick,
        tables=tables.tables(measurements),
        figures=figures,
        answers=answers.answers(measurements, figures),
        studies=studies.numbers(),
    )
    missing = [(f"Table {table.number}", table.missing) for table in content.tables]
    missing += [(f"Figure {figure.number}", figure.missing) for figure in content.figures]
    for name, reason in missing:
        if reason is not None:
            _note(f"{name}: {reason}")
    for path in page.write(content, args.out):
        print(path)


def _draw(args: argparse.Namespace) -> tuple[Figure, ...]:
    """Returns figures 3.6 to 3.11, or the reason why they cannot be drawn here."""
    try:
        import PIL  # noqa: F401

        prepare_blender()
    except (ImportError, SinewError) as error:
        return meshes.missing(f"Not drawn: {error}. Install bpy and pillow and try again.")
    from sinew_addon.features.pages.render import chosen_engine

    from . import figures

    engine = chosen_engine(args.engine)
    size = QUICK_PICTURE_SIZE if args.quick else PICTURE_SIZE
    with scratch_folder() as scratch:
        return figures.figures(args.blend_files, engine, size, scratch, _note)


def _note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main(argv: list[str]) -> int:
    """Returns the exit status: 0 all went well, 1 something did not, 2 wrong use."""
    try:
        run(parse(argv))
    except SinewError as error:
        _note(f"report: {error}")
        return 2 if isinstance(error, WrongUse) else 1
    return 0


if __name__ == "__main__":
    status = main(sys.argv[1:])
    if "bpy" in sys.modules:
        leave_blender(status)
    sys.exit(status)
