# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `sinew`, in plain Python with bpy as a module and as `blender --command sinew`."""

from __future__ import annotations

import argparse
import atexit
import re
import sys
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, NoReturn, Protocol, cast

from . import native
from .base import interrupt
from .base.errors import SinewError, WrongUse
from .base.output import sentence as output_sentence
from .prepare import leave_blender, prepare_blender

if TYPE_CHECKING:
    from .commands.console import Console

# In the order of the help: each is a module of commands/.
COMMANDS = (
    *(
        "methods",
        "info",
        "check",
        "points",
        "reskin",
        "restore",
        "inbetween",
        "blend",
        "bake",
        "export",
    ),
    *("compare", "flex", "render"),
)
# Batches start Blenders of their own, or prepare this one later.
WITHOUT_BLENDER = ("methods", "check", "flex", "reskin", "restore")

_commands: list[object] = []


class Command(Protocol):
    """What a module of commands/ defines."""

    SUMMARY: str
    HELP: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None: ...

    def run(self, args: argparse.Namespace, console: Console) -> int: ...


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One sentence, as of all that is wrong."""
        raise WrongUse(message)


def make_parser() -> tuple[argparse.ArgumentParser, dict[str, Command]]:
    """Returns the parser of the whole command line, and the module of each subcommand."""
    from .commands.console import discarded_output

    # As a module, Blender 5.3 prints a line where the environment names a colour configuration (OCIO).
    with discarded_output():
        modules = {name: cast(Command, import_module(f"{__package__}.commands.{name}")) for name in COMMANDS}
    parser = _Parser(prog="sinew", description="Skinning for Blender files.")
    parser.add_argument("--verbose", action="store_true", help="show what Blender prints")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, module in modules.items():
        # Several lines are wrapped as they should be shown.
        lines = argparse.RawDescriptionHelpFormatter if "\n" in module.HELP else argparse.HelpFormatter
        own = subparsers.add_parser(name, help=module.SUMMARY, description=module.HELP, formatter_class=lines)
        module.add_arguments(own)
    return parser, modules


def main(argv: list[str]) -> int:
    """Runs one command. Returns the exit status: 0 all went well, 1 something did not, 2 wrong use, 130
    Ctrl-C."""
    with interrupt.deferred():
        try:
            return _main(argv)
        except KeyboardInterrupt:
            print("sinew: stopped", file=sys.stderr)
            return 130


def _main(argv: list[str]) -> int:
    reason = native.load_error()
    interrupt.check()
    if reason is not None:
        print(f"sinew: {reason}", file=sys.stderr)
        return 1
    from .commands import console

    parser, modules = make_parser()
    output = console.keep_output()
    try:
        args = parser.parse_args(_with_signed_frames(argv))
        if not args.verbose:
            output = console.take_over_output()
        if args.command not in WITHOUT_BLENDER:
            prepare_blender()
        return modules[args.command].run(args, output)
    except SystemExit as stop:
        # Raised by the parser: within Blender, exiting would skip Blender's own cleanup.
        return stop.code if isinstance(stop.code, int) else 2
    except SinewError as error:
        output.complain(error)
        return 2 if isinstance(error, WrongUse) else 1
    except OSError as error:
        # Errors of paths and disks that no command expects.
        output.complain(output_sentence(error))
        return 1
    except KeyboardInterrupt as stop:
        output.complain(": ".join(("stopped", *map(str, stop.args))))
        return 130
    finally:
        with suppress(OSError):
            output.out.flush()
            output.err.flush()


def _with_signed_frames(argv: list[str]) -> list[str]:
    """Joins frames such as -5-3 with --frames, as argparse would take them for an option."""
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
    # As in registration.py: with bpy as a module, a command that is still registered at the end of the
    # process crashes it.
    atexit.register(unregister_command)


def unregister_command() -> None:
    import bpy

    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
