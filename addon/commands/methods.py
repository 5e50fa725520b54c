# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew methods`: lists the methods, and the stages that may follow them."""

import argparse
import math

import sinew

from ..skinning import variants
from ..skinning.engines import METHODS, Engine
from ..skinning.parameters import PRESETS
from .arguments import add_json
from .console import Console

SUMMARY = "show the skinning methods and when to use each"
HELP = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_json(parser)


def run(args: argparse.Namespace, console: Console) -> int:
    methods, stages = list(METHODS.values()), sinew.stages()
    if args.json:
        rows = {
            "methods": [
                _facts(method) | {"group": method.group, "needs": list(method.needs)} for method in methods
            ],
            "stages": [_facts(stage) for stage in stages],
            "variants": {
                "syntax": variants.SYNTAX,
                "pattern": variants.pattern(),
                "alone": dict(variants.WHOLE),
                "settings": {name: list(values) for name, values in variants.SETTINGS.items()},
            },
            "presets": [{"name": name, "description": text} for name, text in PRESETS.items()],
        }
        console.say_json(rows)
    else:
        console.table(
            ("method", "group", "label", "when to use it", "parameters", "needs"),
            [
                (m.name, m.group, m.label, m.description, ", ".join(_parameters(m)), _needs(m))
                for m in methods
            ],
        )
        console.table(
            ("stage", "parameters", "what it does"),
            [(s.name, ", ".join(_parameters(s)), s.description) for s in stages],
        )
        console.table(("preset", "what it chooses"), list(PRESETS.items()))
        console.say(f"A variant is {variants.SYNTAX}.")
    return 0


def _facts(row: sinew.Method | Engine | sinew.Stage) -> dict:
    """Returns the facts of a method or a stage; its parameters by the names that --set takes."""
    facts = {"name": row.name, "label": row.label, "description": row.description, "source": row.source}
    return facts | {"parameters": _parameters(row)}


def _parameters(row: sinew.Method | Engine | sinew.Stage) -> dict[str, dict]:
    names = ("label", "description", "unit", "kind", "default")
    found = {}
    for each in row.parameters:
        facts: dict = {name: getattr(each, name) for name in names}
        if each.choices:
            facts["choices"] = list(each.choices)
        # JSON has no infinity.
        bounds = {"min": each.min, "max": each.max}
        facts |= {name: value for name, value in bounds.items() if value is not None and math.isfinite(value)}
        found[f"{row.name}.{each.id}"] = facts
    return found


def _needs(method: sinew.Method | Engine) -> str:
    return ", ".join(method.needs).replace("_", " ") or "nothing more"
