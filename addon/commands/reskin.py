# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew reskin`: writes copies of files in which every armature-deformed mesh uses Sinew."""

import argparse

import sinew

from ..base.frames import parse_frames
from ..jobs.job_file import Settings, keys
from ..skinning.parameters import PRESETS, as_texts
from . import batch
from .arguments import add_method, add_set
from .console import Console

SUMMARY = "write copies of files whose meshes are deformed by Sinew"
HELP = (
    "Writes a copy of each file in which every armature-deformed mesh uses Sinew with the "
    "method chosen, and a report that compares the two. Inputs are never written to."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    batch.add_arguments(parser)
    add_method(parser, "a method of `sinew methods`; this or --preset unless the job file has one")
    parser.add_argument("--job", metavar="FILE.toml", help="settings for files and objects (docs/batch.md)")
    parser.add_argument("--job-help", action=_JobHelp, nargs=0, help="show the keys of a job file and exit")
    parser.add_argument(
        "--frames",
        default="auto",
        help="frames at which copies are compared with the Armature modifier, such as 1,12,40-48; none; or "
        "auto, nine of the scene's (default)",
    )
    parser.add_argument(
        "--no-pictures", dest="pictures", action="store_false", help="a report without pictures, much faster"
    )
    add_set(parser)


class _JobHelp(argparse.Action):
    """Prints the keys of a job file and exits, as --help does."""

    def __call__(self, parser: argparse.ArgumentParser, *_others: object) -> None:
        for key in keys():
            print(f"{key.name}  ({key.headers})\n    {key.help}\n    takes {key.wanted}")
        parser.exit()


def _methods() -> list[str]:
    return [*(method.name for method in sinew.methods()), *PRESETS]


def run(args: argparse.Namespace, console: Console) -> int:
    if args.frames not in ("auto", "none"):
        parse_frames(args.frames)
    given = Settings(method=args.method, set=tuple(as_texts(args.set)))
    return batch.run(args, console, batch.Action("reskin", "re-skinned", given, args.job, _methods()))
