# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew report`: repeats the experiments of Smith 2013, on one page."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..core.errors import SinewError, WrongUse
from ..core.output import folder_to_write
from ..core.report.model import Figure, Page
from ..core.scratch import scratch_folder
from .arguments import add_engine
from .console import Console

PICTURE_SIZE, QUICK_PICTURE_SIZE = 520, 64
NO_FILES = (
    "Not drawn in this installation: it takes Sinew's example rigs report_links.blend and "
    "report_mesh.blend. ./dev report passes them on in a checkout; elsewhere, give their folder: sinew "
    "report --blend-files FOLDER."
)


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "report",
        help="do the experiments of Smith 2013 again and write them as one page",
        description="Writes FOLDER/report.html, which needs no other file, and report.json: Tables 3.1 "
        "to 3.10 and Figures 3.3 to 3.11 of Smith 2013, each with the printed values, Sinew's and whether "
        "they agree. An installed Sinew computes Tables 3.1 and 3.6 to 3.8 and, with matplotlib, Figures "
        "3.3 to 3.5. Operation counts and times (Tables 3.2 to 3.5, 3.9, 3.10) take programs that are "
        "built against GLM and Eigen, and pictures (Figures 3.6 to 3.11) Sinew's example rigs: ./dev report "
        "in a checkout builds the programs and passes on both. The page says what was left out and why. "
        "--results also writes its best five results as a short page for a site, of a whole report.json.",
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
    return parser


def run(args: argparse.Namespace, console: Console) -> int:
    from ..core.report import paper

    made = args.made
    if made is not None and (args.out is not None or args.results is None):
        raise WrongUse("--from takes --results FOLDER, and no --out")
    if made is None:
        if args.out is None:
            raise WrongUse("--out FOLDER is missing: where to write report.html and report.json")
        _make(args, console)
        made = args.out / "report.json"
    if args.results is not None:
        content = paper.read(made)
        for path in paper.write(content, args.results):
            console.say(str(path))
    return 0


def _make(args: argparse.Namespace, console: Console) -> None:
    """Writes report.html and report.json."""
    import sinew

    from ..core.report import answers, joints, measure, meshes, page, paths, studies, tables

    for folder in (args.programs, args.blend_files):
        if folder is not None and not folder.is_dir():
            raise SinewError(f"{folder}: no such folder")
    measurements = None
    if args.programs is not None:
        measurements = measure.measure(args.programs, args.quick, console.note)
    console.note("Computing Figures 3.3 to 3.5")
    plots = (joints.figure_3_3(), paths.figure_3_4(), paths.figure_3_5())
    pictures = meshes.missing(NO_FILES) if args.blend_files is None else _draw(args, console)
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
            console.note(f"{name}: {reason}")
    for path in page.write(content, args.out):
        console.say(str(path))


def _draw(args: argparse.Namespace, console: Console) -> tuple[Figure, ...]:
    """Returns figures 3.6 to 3.11, or the reason why this installation cannot draw them."""
    from ..core.report import meshes
    from ..prepare import prepare_blender

    try:
        import PIL  # noqa: F401

        prepare_blender()
    except (ImportError, SinewError) as error:
        return meshes.missing(
            f"Not drawn in this installation: {error}. Install bpy and pillow and try again."
        )
    from ..features.pages import render, report_figures

    engine = render.chosen_engine(args.engine)
    size = QUICK_PICTURE_SIZE if args.quick else PICTURE_SIZE
    with scratch_folder() as scratch:
        return report_figures.figures(args.blend_files, engine, size, scratch, console.note)
