# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `sinew`, in plain Python with bpy as a module and as `blender --command sinew`."""

from __future__ import annotations

import argparse
import atexit
import re
import sys

from .core import interrupt
from .core.errors import SinewError, WrongUse
from .prepare import leave_blender, prepare_blender

# The batches have Blenders of their own, or ask for this one; a report without Blender has no pictures.
WITHOUT_BLENDER = ("methods", "report", "reskin", "restore")

_commands: list[object] = []


def main(argv: list[str]) -> int:
    """Runs one command. Exit status: 0 all went well, 1 something did not, 2 wrong use."""
    from .commands import (
        bake,
        compare,
        console,
        inbetween,
        info,
        methods,
        points,
        render,
        report,
        reskin,
        restore,
    )

    modules = {
        "methods": methods,
        "info": info,
        "points": points,
        "reskin": reskin,
        "restore": restore,
        "inbetween": inbetween,
        "bake": bake,
        "compare": compare,
        "render": render,
        "report": report,
    }
    parser = argparse.ArgumentParser(prog="sinew", description="Skinning for Blender files.")
    parser.add_argument("--verbose", action="store_true", help="show what Blender prints")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in modules.values():
        module.add_parser(subparsers)
    try:
        args = parser.parse_args(_with_signed_frames(argv))
    except SystemExit as stop:
        # Inside Blender an exit would skip its own ending.
        return stop.code if isinstance(stop.code, int) else 2
    output = console.keep_output() if args.verbose else console.take_over_output()
    try:
        if args.command not in WITHOUT_BLENDER:
            prepare_blender()
        with interrupt.heard():
            return modules[args.command].run(args, output)
    except SinewError as error:
        output.complain(error)
        return 2 if isinstance(error, WrongUse) else 1
    except KeyboardInterrupt as stop:
        output.complain(": ".join(("stopped", *map(str, stop.args))))
        return 130
    finally:
        output.out.flush()
        output.err.flush()


def _with_signed_frames(argv: list[str]) -> list[str]:
    """Frames such as -5-3 belong to --frames: by themselves argparse takes them for an option."""
    joined: list[str] = []
    for argument in argv:
        if joined and joined[-1] in ("--frames", "--frame") and re.fullmatch(r"-[\d.][\d.,\s-]*", argument):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def run() -> None:
    """Entry point of the program in plain Python."""
    status = main(sys.argv[1:])
    if "bpy" in sys.modules:
        leave_blender(status)
    sys.exit(status)


def register_command() -> None:
    """Makes `blender --command sinew` run this."""
    import bpy

    _commands.append(bpy.utils.register_cli_command("sinew", main))
    # As in blender/registration.py: left registered at the end of a process with bpy as a module, it crashes.
    atexit.register(unregister_command)


def unregister_command() -> None:
    import bpy

    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
