# SPDX-License-Identifier: GPL-3.0-or-later
"""The job file: a batch's settings in TOML, for all files, for some, for single objects (docs/batch.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from ..core.errors import WrongUse


@dataclass(frozen=True)
class ObjectRule:
    """The method of the objects whose name matches."""

    match: str
    method: str


@dataclass(frozen=True)
class Settings:
    """What is done to the meshes of a file; None or empty where nothing is said.

    include, exclude  patterns of names of objects and of collections
    objects           later ones win
    """

    method: str | None = None
    include: tuple[str, ...] | None = None
    exclude: tuple[str, ...] | None = None
    objects: tuple[ObjectRule, ...] = ()

    def overridden_by(self, other: Settings) -> Settings:
        return Settings(
            other.method or self.method,
            self.include if other.include is None else other.include,
            self.exclude if other.exclude is None else other.exclude,
            self.objects + other.objects,
        )

    def as_task(self) -> dict:
        """What a task takes along, and the journal keeps."""
        return {
            "method": self.method,
            "include": list(self.include or ()),
            "exclude": list(self.exclude or ()),
            "objects": [[rule.match, rule.method] for rule in self.objects],
        }


@dataclass(frozen=True)
class FileRule:
    """Settings of the files whose path matches, as "hero*.blend" or "characters/*.blend", from the right."""

    match: tuple[str, ...]
    settings: Settings
    line: int

    def matches(self, path: PurePath) -> bool:
        return any(path.match(pattern) for pattern in self.match)


@dataclass(frozen=True)
class JobFile:
    """A whole job file; `inputs` and `out` are relative to its folder, as read."""

    inputs: tuple[str, ...] = ()
    out: str | None = None
    settings: Settings = Settings()
    files: tuple[FileRule, ...] = ()

    def settings_of(self, source: PurePath, given: Settings) -> Settings:
        """A file's settings: the job file's own, those `given` on the command line, those of each rule that
        matches; later ones win."""
        settings = self.settings.overridden_by(given)
        for rule in self.files:
            if rule.matches(source):
                settings = settings.overridden_by(rule.settings)
        return settings


def read_job_file(path: Path, methods: Collection[str]) -> JobFile:
    """Raises WrongUse, with file and line, for anything that is not as it should be."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise WrongUse(f"{path}:{line}: is not UTF-8") from None
    except OSError as error:
        raise WrongUse(f"{path}: can not be read: {error.strerror}") from None
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise WrongUse(f"{path}: {error}") from None
    return _Reader(path, text, methods).job_file(table)


Place = tuple[str | int, ...]
"""Where a value stands: keys, and numbers in arrays of tables, from the file's beginning."""


@dataclass
class _Reader:
    path: Path
    text: str
    methods: Collection[str]
    base: Path = field(init=False)

    def __post_init__(self) -> None:
        self.base = self.path.resolve().parent

    def job_file(self, table: dict) -> JobFile:
        self._known_keys(table, (), ("inputs", "out", "method", "include", "exclude", "objects", "files"))
        return JobFile(
            inputs=tuple(str(self.base / name) for name in self._strings(table, (), "inputs") or ()),
            out=str(self.base / self._string(table, (), "out")) if "out" in table else None,
            settings=self._settings(table, ()),
            files=tuple(self._file_rule(entry, place) for entry, place in self._tables(table, (), "files")),
        )

    def _file_rule(self, table: dict, place: Place) -> FileRule:
        self._known_keys(table, place, ("match", "method", "include", "exclude", "objects"))
        self._required(table, place, "match")
        return FileRule(self._strings(table, place, "match"), self._settings(table, place), self._line(place))

    def _settings(self, table: dict, place: Place) -> Settings:
        return Settings(
            self._method(table, place) if "method" in table else None,
            self._strings(table, place, "include"),
            self._strings(table, place, "exclude"),
            tuple(self._object_rule(entry, at) for entry, at in self._tables(table, place, "objects")),
        )

    def _object_rule(self, table: dict, place: Place) -> ObjectRule:
        self._known_keys(table, place, ("match", "method"))
        for key in ("match", "method"):
            self._required(table, place, key)
        return ObjectRule(self._string(table, place, "match"), self._method(table, place))

    def _method(self, table: dict, place: Place) -> str:
        name = self._string(table, place, "method")
        if name not in self.methods:
            self._fail((*place, "method"), f"method: expected one of {', '.join(self.methods)}, got {name!r}")
        return name

    def _string(self, table: dict, place: Place, key: str) -> str:
        value = table[key]
        if not isinstance(value, str) or not value:
            self._fail((*place, key), f"{key}: expected text in quotes, got {value!r}")
        return value

    def _strings(self, table: dict, place: Place, key: str) -> tuple[str, ...] | None:
        """One string or a list of them."""
        if key not in table:
            return None
        value = table[key]
        values = value if isinstance(value, list) else [value]
        if not all(isinstance(v, str) and v for v in values):
            self._fail((*place, key), f'{key}: expected a list such as ["a*", "b"], got {value!r}')
        return tuple(values)

    def _tables(self, table: dict, place: Place, key: str) -> list[tuple[dict, Place]]:
        entries = table.get(key, [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            header = ".".join([*(str(p) for p in place if isinstance(p, str)), key])
            self._fail((*place, key), f"{key}: expected entries that begin with [[{header}]]")
        return [(entry, (*place, key, number)) for number, entry in enumerate(entries)]

    def _known_keys(self, table: dict, place: Place, known: Sequence[str]) -> None:
        for key in table:
            if key not in known:
                self._fail((*place, key), f"{key}: no such key; expected one of {', '.join(known)}")

    def _required(self, table: dict, place: Place, key: str) -> None:
        if key not in table:
            self._fail(place, f"{key} is missing")

    def _fail(self, place: Place, sentence: str) -> None:
        raise WrongUse(f"{self.path}:{self._line(place)}: {sentence}")

    def _line(self, place: Place) -> int:
        """The line, from 1, on which the value at `place` begins."""
        return _line_where(self.text, lambda table: _holds(table, place))


def _line_where(text: str, holds: Callable[[dict], bool]) -> int:
    """The line on which the statement begins that first makes `holds` true: of the beginnings of the file
    that are TOML themselves, the first such ends with it."""
    lines = text.splitlines()
    begin = 0
    for end in range(1, len(lines) + 1):
        try:
            table = tomllib.loads("\n".join(lines[:end]))
        except tomllib.TOMLDecodeError:
            continue
        if holds(table):
            break
        begin = end
    while not lines[begin].strip() or lines[begin].lstrip().startswith("#"):
        begin += 1
    return begin + 1


def _holds(table: dict, place: Place) -> bool:
    value: object = table
    for step in place:
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            return False
    return True
