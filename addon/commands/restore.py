# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew restore`: writes copies of re-skinned files with their original Armature modifiers."""

import argparse

from . import batch
from .console import Console

SUMMARY = "write copies of re-skinned files with their Armature modifiers as they were"
HELP = (
    "Writes a copy of each file in which Sinew is taken off every mesh: Armature modifiers, "
    "settings and data are as they were before. Inputs are never written to."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    batch.add_arguments(parser)
    parser.set_defaults(frames="none", pictures=False)


def run(args: argparse.Namespace, console: Console) -> int:
    return batch.run(args, console, batch.Action("restore", "restored"))
