# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments that several commands share."""

import argparse
from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import sinew

from ..base.errors import WrongUse
from ..base.frames import parse_frames
from ..base.options import options_of
from ..base.output import file_to_write, folder_to_write
from ..skinning import parameters
from ..skinning.variants import Variant, parse_list

FILES = ".blend, .glb, .gltf, .fbx or .usd (.usda, .usdc, .usdz)"


def count(text: str, least: int = 1) -> int:
    number = int(text)
    if number < least:
        raise argparse.ArgumentTypeError(f"expected {least} or more, got {number}")
    return number


def count_or_none(text: str) -> int:
    return count(text, 0)


def percent(text: str) -> float:
    number = float(text)
    if not 0.0 < number <= 100.0:
        raise argparse.ArgumentTypeError(f"expected more than 0 and at most 100, got {text}")
    return number


def percent_or_none(text: str) -> float:
    return percent(text) if float(text) else 0.0


def seconds(text: str) -> float:
    number = float(text)
    if not 0 <= number < float("inf"):
        raise argparse.ArgumentTypeError(f"expected 0 or more, got {text}")
    return number


def pixels(text: str) -> int:
    number = int(text)
    if not 64 <= number <= 4096:
        raise argparse.ArgumentTypeError(f"expected 64 to 4096 pixels, got {number}")
    return number


def method(text: str) -> str:
    """The type of an argument that names a method of `sinew methods`."""
    return one_of([method.name for method in sinew.methods()])(text)


def add_method(
    parser: argparse.ArgumentParser,
    text: str,
    required: bool = False,
    read: Callable[[str], str] = method,
) -> None:
    """Adds --method, and --preset in its place.

    text  the help of --method
    """
    group = parser.add_mutually_exclusive_group(required=required)
    group.add_argument("--method", type=read, help=text)
    group.add_argument(
        "--preset",
        dest="method",
        choices=tuple(parameters.PRESETS),
        help="what Sinew chooses by measuring, instead of a method; --set overrides it",
    )


def one_of(names: Collection[str]) -> Callable[[str], str]:
    """The type of an argument of many choices, which `choices` would repeat in each line of help."""

    def read(text: str) -> str:
        if text not in names:
            raise argparse.ArgumentTypeError(f"expected one of {', '.join(names)}, got {text!r}")
        return text

    return read


def methods(text: str) -> list[str]:
    """The type of an argument that names methods of `sinew methods`, or the Armature modifier."""
    read = one_of([*(method.name for method in sinew.methods()), "blender"])
    return [read(name.strip()) for name in text.split(",")]


def variants(text: str) -> list[Variant]:
    """The type of an argument of variants that commas divide."""
    try:
        return parse_list(text)
    except WrongUse as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help=FILES)


def add_files(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help=FILES)


def add_frames(
    parser: argparse.ArgumentParser, text: str = "such as 1,12,40-48", required: bool = False
) -> None:
    parser.add_argument("--frames", type=parse_frames, required=required, help=text)


def file_named(*endings: str) -> Callable[[str], Path]:
    """The type of an argument that names a file to write, or to replace."""
    return partial(file_to_write, endings=endings)


def add_object(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--object", metavar="NAME", help="only this mesh")


def add_viewer(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--viewer", type=file_named(".html"), metavar="PAGE.html", help=text)


def check_viewer(page: Path | None, files: int) -> None:
    if page is not None and files > 1:
        raise WrongUse(f"{page}: --viewer writes the page of a single file")


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON")


def add_engine(parser: argparse.ArgumentParser, default: str | None = "auto") -> None:
    parser.add_argument(
        "--engine",
        choices=("auto", "workbench", "cycles"),
        default=default,
        help="of the pictures; auto, the default: Workbench, or Cycles where there is no OpenGL",
    )


def add_copies(parser: argparse.ArgumentParser) -> None:
    """Adds inputs, --out and --overwrite, for commands that write a file for each input."""
    parser.add_argument("inputs", nargs="+", metavar="FILE_OR_FOLDER")
    parser.add_argument(
        "--out", required=True, type=folder_to_write, metavar="DIR", help="folder for what is written"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist already")


def add_options(
    parser: argparse.ArgumentParser, options: type, before: str = "", chosen_by: Mapping[str, str] = {}
) -> None:
    """Adds an argument for each option of a dataclass.

    before     each one's help
    chosen_by  by the names of options that have no value unless they are given, what then chooses it
    """
    for name, (default, shown) in options_of(options).items():
        text = f"{before}{shown.text[:1].lower()}{shown.text[1:]}".replace("%", "%%")
        known: dict[str, Any] = {"default": default, "help": f"{text} (default: %(default)s)"}
        if isinstance(default, bool):
            known |= {"help": text, "action": argparse.BooleanOptionalAction if default else "store_true"}
        elif len(shown.choices) > 4:
            known |= {
                "type": one_of(shown.names),
                "help": f"one of {', '.join(shown.names)} (default: {default})",
            }
        elif shown.choices:
            known["choices"] = shown.names
        elif isinstance(default, str):
            known |= {"metavar": shown.label.upper(), "help": text}
        elif shown.kind == "percent":
            known |= {"type": percent_or_none, "metavar": "PERCENT", "help": text}
        else:
            known |= {"type": count if shown.least else count_or_none, "metavar": "N"}
        if name in chosen_by:
            known |= {"default": None, "help": f"{text} (default: {default}, or what {chosen_by[name]})"}
        parser.add_argument(f"--{name.replace('_', '-')}", **known)


def add_set(parser: argparse.ArgumentParser) -> None:
    """Adds --set, whose value is the dictionary from parameters.parse()."""
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
