# SPDX-License-Identifier: GPL-3.0-or-later
"""The subcommands of `sinew`, one module each: `add_parser(subparsers)` and `run(args, console) -> int`."""
