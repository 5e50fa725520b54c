# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments that several commands have."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from ..core import parameters
from ..core.errors import WrongUse


def count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"expected at least 1, got {number}")
    return number


def add_set(parser: argparse.ArgumentParser) -> None:
    """Adds --set, whose value is the dictionary of parameters.parse()."""
    parser.add_argument(
        "--set",
        action=_Set,
        default={},
        metavar="NAME=VALUE",
        help="a parameter of a method or a stage of `sinew methods`, such as mix=dq and mix.group=NAME; may "
        "be given several times",
    )


class _Set(argparse.Action):
    def __call__(
        self, _parser: object, namespace: argparse.Namespace, value: object, _option: object = None
    ) -> None:
        known: Mapping[str, parameters.Value] = getattr(namespace, self.dest)
        try:
            setattr(namespace, self.dest, {**known, **parameters.parse([str(value)])})
        except WrongUse as error:
            raise argparse.ArgumentError(None, str(error)) from None


def seconds(text: str) -> float:
    number = float(text)
    if not 0 <= number < float("inf"):
        raise argparse.ArgumentTypeError(f"expected 0 or more, got {text}")
    return number
