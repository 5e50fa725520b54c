# SPDX-License-Identifier: GPL-3.0-or-later
"""The job file: a batch's settings in TOML, for all files, for some files, for single objects
(docs/batch.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any, TypeAlias

from ..base.errors import WrongUse
from ..skinning.parameters import parse
from ..skinning.scale_rule import SCALE_RULES

Position: TypeAlias = tuple[str | int, ...]
"""The path to a value in a file: keys from the top, and an index for each entry of a list of tables."""

# The tables of a job file.
TOP, OBJECTS, FILES = "top", "objects", "files"
# Their headers, in the order of documents.
_HEADERS = {"top": TOP, "[[objects]]": OBJECTS, "[[files]]": FILES, "[[files.objects]]": OBJECTS}


@dataclass(frozen=True)
class ObjectRule:
    """Settings of the objects whose name matches; None for what the file does not set."""

    match: str
    method: str | None = None
    scale: str | None = None
    set: tuple[str, ...] | None = None

    def as_task(self) -> dict:
        parameters = None if self.set is None else list(self.set)
        given = {"method": self.method, "scale": self.scale, "set": parameters}
        return {"match": self.match} | {key: value for key, value in given.items() if value is not None}


@dataclass(frozen=True)
class Settings:
    """Settings of a file's meshes; None or empty where nothing is set.

    include, exclude  patterns of names of objects and of collections
    scale             name of a scale rule
    set               parameters as NAME=VALUE; later ones override earlier ones
    objects           later rules override earlier ones
    """

    method: str | None = None
    include: tuple[str, ...] | None = None
    exclude: tuple[str, ...] | None = None
    scale: str | None = None
    set: tuple[str, ...] = ()
    objects: tuple[ObjectRule, ...] = ()

    def overridden_by(self, other: Settings) -> Settings:
        return Settings(
            other.method or self.method,
            self.include if other.include is None else other.include,
            self.exclude if other.exclude is None else other.exclude,
            other.scale or self.scale,
            self.set + other.set,
            self.objects + other.objects,
        )

    def as_task(self) -> dict:
        """Returns the settings as JSON, for tasks and for the journal."""
        return {
            "method": self.method,
            "include": list(self.include or ()),
            "exclude": list(self.exclude or ()),
            "scale": self.scale,
            "set": list(self.set),
            "objects": [rule.as_task() for rule in self.objects],
        }


@dataclass(frozen=True)
class FileRule:
    """Settings of the files whose path matches, as "hero*.blend" or "characters/*.blend", compared from the
    right."""

    match: tuple[str, ...]
    settings: Settings
    line: int

    def matches(self, path: PurePath) -> bool:
        """Whether a pattern matches, or equals the end of the path, as a path can contain brackets."""
        ends = (PurePath(pattern).parts for pattern in self.match)
        return any(map(path.match, self.match)) or any(path.parts[-len(end) :] == end for end in ends)


@dataclass(frozen=True)
class JobFile:
    """A whole job file; `inputs` and `out` are relative to its folder."""

    inputs: tuple[str, ...] = ()
    out: str | None = None
    settings: Settings = Settings()
    files: tuple[FileRule, ...] = ()

    def settings_of(self, source: PurePath, given: Settings) -> Settings:
        """Returns a file's settings: the job file's own, those `given` on the command line, those of each
        rule that matches; later ones override earlier ones."""
        settings = self.settings.overridden_by(given)
        for rule in self.files:
            if rule.matches(source):
                settings = settings.overridden_by(rule.settings)
        return settings


# --- Keys


@dataclass(frozen=True)
class Key:
    """A key of some tables.

    read    converts and checks a value; raises WrongUse with a sentence that follows the key's name; None for
            a list of tables of that name
    wanted  a short description of the value for documents
    help    one sentence for documents
    """

    name: str
    tables: tuple[str, ...]
    read: Callable[[Any], Any] | None
    wanted: str
    help: str

    @property
    def headers(self) -> str:
        return ", ".join(header for header, table in _HEADERS.items() if table in self.tables)


def _text(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise WrongUse(f"expected text in quotes, got {value!r}")
    return value


def _texts(value: object) -> tuple[str, ...]:
    values = value if isinstance(value, list) else [value]
    if not all(isinstance(one, str) and one for one in values):
        raise WrongUse(f'expected a list such as ["a*", "b"], got {value!r}')
    return tuple(values)


def _one_of(names: Collection[str]) -> Callable[[object], str]:
    def read(value: object) -> str:
        name = _text(value)
        if name not in names:
            raise WrongUse(f"expected one of {', '.join(names)}, got {name!r}")
        return name

    return read


def _parameters(value: object) -> tuple[str, ...]:
    texts = _texts(value)
    parse(texts)
    return texts


def _paths(value: object) -> tuple[str, ...]:
    patterns = _texts(value)
    if not all(PurePath(pattern).parts for pattern in patterns):
        raise WrongUse(f"expected paths such as hero*.blend, got {list(patterns)!r}")
    return patterns


def keys(methods: Collection[str] = ()) -> tuple[Key, ...]:
    """Returns all keys: the reader, `sinew reskin --job-help` and docs/batch.md are made from this list.

    methods  the allowed values of `method`
    """
    of_all, of_files = (TOP, OBJECTS, FILES), (TOP, FILES)
    scales = [rule.name for rule in SCALE_RULES]
    text_or_list, below = "text or a list", "relative to the folder of the job file"
    return (
        Key("inputs", (TOP,), _texts, text_or_list, f"files, folders and patterns, {below}"),
        Key("out", (TOP,), _text, "text", f"folder of the copies, {below}"),
        Key(
            "method",
            of_all,
            _one_of(methods),
            "a method or preset of `sinew methods`",
            "how the meshes are deformed",
        ),
        Key(
            "scale",
            of_all,
            _one_of(scales),
            f"one of {', '.join(scales)}",
            "the rule for the bones' scale; without it, each object keeps its own rule",
        ),
        Key(
            "set",
            of_all,
            _parameters,
            'NAME=VALUE, or a list such as ["mix=dq", "mix.group=Arms"]',
            "parameters of methods and stages, as of `sinew methods`",
        ),
        Key(
            "include",
            of_files,
            _texts,
            text_or_list,
            "only objects, or collections, of these names or patterns",
        ),
        Key("exclude", of_files, _texts, text_or_list, "objects, or collections, to leave out"),
        Key(OBJECTS, of_files, None, "tables", "settings of some objects; later ones win"),
        Key(FILES, (TOP,), None, "tables", "settings of some files; later ones win"),
        Key("match", (OBJECTS,), _text, "text; required", "name or pattern of objects"),
        Key(
            "match",
            (FILES,),
            _paths,
            "paths or patterns such as hero*.blend; required",
            "files whose path ends with one of these",
        ),
    )


def markdown() -> str:
    """Returns the keys as a table for docs/batch.md."""
    lines = ["| key | where | value | meaning |", "|---|---|---|---|"]
    lines += [f"| `{key.name}` | {key.headers} | {key.wanted} | {key.help} |" for key in keys()]
    return "\n".join(lines)


# --- Reading


class _NotAllowed(Exception):  # noqa: N818
    """A value that a key does not allow. The sentence says what was expected and what was found."""

    def __init__(self, position: Position, sentence: str) -> None:
        super().__init__(sentence)
        self.position = position


def read_job_file(path: Path, methods: Collection[str]) -> JobFile:
    """Reads a job file. Raises WrongUse, with file and line, for anything that no key allows."""
    try:
        # Some editors start a file with a byte order mark.
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise WrongUse(f"{path}:{line}: is not UTF-8") from None
    except OSError as error:
        raise WrongUse(f"{path}: can not be read: {error.strerror}") from None
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise WrongUse(f"{path}: {error}") from None
    try:
        values = _Reader(text, keys(methods)).read(TOP, table)
    except _NotAllowed as wrong:
        raise WrongUse(f"{path}:{_line_of(text, wrong.position)}: {wrong}") from None
    base = path.resolve().parent
    inputs, out, files = (values.pop(name, None) for name in ("inputs", "out", FILES))
    return JobFile(
        inputs=tuple(str(base / name) for name in inputs or ()),
        out=str(base / out) if out is not None else None,
        settings=Settings(**values),
        files=files or (),
    )


@dataclass(frozen=True)
class _Reader:
    text: str
    keys: tuple[Key, ...]

    def read(self, name: str, table: dict[str, Any], position: Position = ()) -> dict[str, Any]:
        """Returns the values of a table. Raises _NotAllowed for the first that is wrong, in the order of the
        file."""
        known = {key.name: key for key in self.keys if name in key.tables}
        for key in table:
            if key not in known:
                sentence = f"{key}: no such key; expected one of {', '.join(known)}"
                raise _NotAllowed((*position, key), sentence)
        if "match" in known and "match" not in table:
            raise _NotAllowed(position, "match is missing")
        values = {key: self._value(known[key], value, (*position, key)) for key, value in table.items()}
        if name == OBJECTS and len(values) == 1:
            raise _NotAllowed(position, "these objects have no settings; expected method, scale or set")
        return values

    def _value(self, key: Key, value: Any, position: Position) -> Any:
        if key.read is not None:
            try:
                return key.read(value)
            except WrongUse as error:
                raise _NotAllowed(position, f"{key.name}: {error}") from None
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            header = ".".join(step for step in position if isinstance(step, str))
            raise _NotAllowed(position, f"{key.name}: expected entries that begin with [[{header}]]")
        return tuple(self._rule(key.name, entry, (*position, n)) for n, entry in enumerate(value))

    def _rule(self, name: str, entry: dict[str, Any], position: Position) -> ObjectRule | FileRule:
        values = self.read(name, entry, position)
        if name == OBJECTS:
            return ObjectRule(**values)
        return FileRule(values.pop("match"), Settings(**values), _line_of(self.text, position))


def _line_of(text: str, position: Position) -> int:
    """Returns the line, from 1, where the value at `position` begins. tomllib reports no positions, so longer
    and longer beginnings of the file are parsed; the first one that has the value ends with its statement."""
    lines = text.splitlines()
    begin = 0
    for end in range(1, len(lines) + 1):
        try:
            table = tomllib.loads("\n".join(lines[:end]))
        except tomllib.TOMLDecodeError:
            continue
        if _has(table, position):
            break
        begin = end
    while not lines[begin].strip() or lines[begin].lstrip().startswith("#"):
        begin += 1
    return begin + 1


def _has(table: dict, position: Position) -> bool:
    value: Any = table
    for step in position:
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            return False
    return True
