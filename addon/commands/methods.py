# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew methods`: the table of methods."""

from __future__ import annotations

import argparse
import json

import sinew

from .console import Console


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    parser = subparsers.add_parser("methods", help="show the skinning methods and when to use each")
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser


def run(args: argparse.Namespace, console: Console) -> int:
    methods = sinew.methods()
    if args.json:
        rows = [
            {"name": m.name, "label": m.label, "description": m.description, "needs": list(m.needs)}
            for m in methods
        ]
        console.say(json.dumps(rows, indent=2))
    else:
        console.table(
            ("method", "label", "when to use it", "needs"),
            [(m.name, m.label, m.description, _needs(m)) for m in methods],
        )
    return 0


def _needs(method: sinew.Method) -> str:
    return ", ".join(method.needs).replace("_", " ") or "nothing more"
