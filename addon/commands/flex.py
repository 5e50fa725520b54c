# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew flex`: bends each joint of characters, and says which deform well."""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import Any

from ..core import interrupt
from ..core.errors import SinewError
from ..core.flex.limits import Table, read_table
from ..core.flex.report import FileReport, junit, lines, markdown
from ..core.output import file_to_write, write_text
from .arguments import add_files, add_json, add_object
from .console import Console

SUMMARY = "bend each joint of characters, and say which deform well"
HELP = """\
Bends every joint of every character by itself, and figures as people move, measures what that does to the
surface, and looks at weights and bones. Files are only read; actions, controls and drivers take no part.

Exit status 0: all joints pass; 1: one does not, or a file can not be judged; 2: wrong use."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    parser.add_argument(
        "--methods",
        type=lambda text: [name.strip() for name in text.split(",")],
        default=[],
        metavar="METHODS",
        help="others to try, of `sinew methods`, such as dq,cor: they are named where they mend a joint; the "
        "verdict is on the method that a file has",
    )
    add_object(parser)
    parser.add_argument("--poses", type=Path, metavar="TABLE.toml", help="poses of joints, in [joints]")
    parser.add_argument(
        "--thresholds", type=Path, metavar="TABLE.toml", help="limits of measures, in [limits]"
    )
    add_json(parser)
    for option, ending, text in (
        ("--junit", ".xml", "for the test pages of build servers"),
        ("--markdown", ".md", "for a pull request"),
    ):
        file = partial(file_to_write, endings=(ending,))
        parser.add_argument(option, type=file, metavar=f"FILE{ending}", help=f"also write a report {text}")


def run(args: argparse.Namespace, console: Console) -> int:
    from ..deform import characters

    characters.check_methods(args.methods)
    table = Table()
    for path in (args.poses, args.thresholds):
        table = table if path is None else read_table(path, table)
    reports = []
    for path in args.files:
        try:
            reports.append(_report(path, table, args, console))
        except SinewError as error:
            reports.append(FileReport(str(path), error=str(error).removeprefix(f"{path}: ")))
        if not args.json:
            for line in lines(reports[-1]):
                console.say(line)
    if args.json:
        content: list[dict[str, Any]] = [report.to_dict() for report in reports]
        console.say(json.dumps(content, indent=2, ensure_ascii=False))
    for target, text in ((args.junit, junit), (args.markdown, markdown)):
        if target is not None:
            write_text(target, text(reports))
            console.note(str(target))
    return 0 if all(report.is_good for report in reports) else 1


def _report(path: Path, table: Table, args: argparse.Namespace, console: Console) -> FileReport:
    import bpy

    from ..attach import properties
    from ..deform import characters
    from ..features.flex import flex
    from ..io import files

    console.note_on(path, files.open_file(path))
    scene = bpy.context.scene
    settings = {
        obj: properties.of(obj).method
        for obj in scene.objects
        if properties.has_sinew(obj) and properties.of(obj).enabled
    }
    meshes, left_out = characters.deformable_meshes(scene, path, ["dq", *args.methods], args.object)
    own: dict[bpy.types.Object, str | None] = {}
    for obj in meshes:
        # Linear blending may be left to the Armature modifier, where nothing could be bent.
        characters.use_method(obj, settings.get(obj, "dq"))
        own[obj] = settings.get(obj, properties.BLENDER)
    steps = flex.flex(meshes, args.methods, table, own)
    with console.bar(f"Bending {path.name}", 1) as show:
        while True:
            try:
                show(next(steps))
            except StopIteration as end:
                return FileReport(str(path), end.value.verdict, tuple(left_out))
            interrupt.check()
