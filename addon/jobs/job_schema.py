# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys of a job file. Its reader, `sinew reskin --job-help` and docs/batch.md are made from this list."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import PurePath
from typing import Any

from ..core.bake import IN_FILE, KINDS, check_frames
from ..core.errors import WrongUse
from ..core.frames import parse_frames
from ..core.parameters import parse
from ..core.scale_rule import SCALE_RULES
from .schema import TEXT, TEXTS, Key, SchemaError, Table, checked, one_of, rows, some_of


def job_schema(methods: Collection[str]) -> Table:
    """Returns the top table of a job file. `methods` are the allowed values of `method`."""
    method = Key("method", one_of(methods, "a method of `sinew methods`"), "how the meshes are deformed")
    scale = Key(
        "scale",
        one_of([rule.name for rule in SCALE_RULES]),
        "the rule for the bones' scale; without it, each object keeps its own rule",
    )
    set_ = Key(
        "set",
        checked(TEXTS, _check_parameters, 'NAME=VALUE, or a list such as ["mix=dq", "mix.group=Arms"]'),
        "parameters of methods and stages, as of `sinew methods`",
    )
    bake = Key(
        "bake",
        checked(some_of(KINDS), _check_one_in_file),
        "bakes to write beside the copies; [] for none",
    )
    of_objects = Table(
        (
            Key("match", TEXT, "name or pattern of objects", required=True),
            method,
            scale,
            set_,
            bake,
        ),
        check=_check_something_set,
    )
    settings = (
        method,
        scale,
        set_,
        Key("include", TEXTS, "only objects, or collections, of these names or patterns"),
        Key("exclude", TEXTS, "objects, or collections, to leave out"),
        bake,
        Key(
            "bake_frames",
            checked(TEXT, _check_frame_list, "frames such as 1,12,40-48"),
            "frames to bake; without it, those of the file's scene",
        ),
        Key("objects", of_objects, "settings of some objects; later ones win"),
    )
    of_files = Table(
        (
            Key(
                "match",
                checked(TEXTS, _check_paths, "paths or patterns such as hero*.blend"),
                "files whose path ends with one of these",
                required=True,
            ),
            *settings,
        ),
        check=_check_bakes,
    )
    return Table(
        (
            Key("inputs", TEXTS, "files, folders and patterns, relative to the folder of the job file"),
            Key("out", TEXT, "folder of the copies, relative to the folder of the job file"),
            *settings,
            Key("files", of_files, "settings of some files; later ones win"),
        ),
        check=_check_bakes,
    )


def markdown() -> str:
    """Returns the keys as a table for docs/batch.md."""
    lines = ["| key | where | value | meaning |", "|---|---|---|---|"]
    for name, headers, wanted, meaning in rows(job_schema(())):
        lines.append(f"| `{name}` | {headers} | {wanted} | {meaning} |")
    return "\n".join(lines)


def bakes(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Returns all kinds of bakes in a table's settings, each once."""
    every = [*values.get("bake", ())]
    every += [kind for entry in values.get("objects", ()) for kind in entry.values.get("bake", ())]
    return tuple(dict.fromkeys(every))


def check_bakes(kinds: Sequence[str], frames: str | None) -> None:
    """Raises WrongUse where a bake is not possible for the frames."""
    if frames is not None:
        for kind in kinds:
            check_frames(kind, sorted(set(parse_frames(frames))))


def _check_bakes(values: Mapping[str, Any]) -> None:
    try:
        check_bakes(bakes(values), values.get("bake_frames"))
    except WrongUse as error:
        raise SchemaError(("bake_frames",), str(error)) from None


def _check_something_set(values: Mapping[str, Any]) -> None:
    if len(values) == 1:
        raise SchemaError((), "these objects have no settings; expected method, scale, set or bake")


def _check_one_in_file(kinds: Sequence[str]) -> None:
    if len([kind for kind in kinds if kind in IN_FILE]) > 1:
        raise WrongUse(f"an object can have one of {', '.join(kind for kind in kinds if kind in IN_FILE)}")


def _check_parameters(texts: Sequence[str]) -> None:
    parse(texts)


def _check_frame_list(text: str) -> None:
    try:
        parse_frames(text)
    except WrongUse as error:
        raise WrongUse(str(error).removeprefix("frames: ")) from None


def _check_paths(patterns: Sequence[str]) -> None:
    if not all(PurePath(pattern).parts for pattern in patterns):
        raise WrongUse(f"expected paths such as hero*.blend, got {list(patterns)!r}")
