# SPDX-License-Identifier: GPL-3.0-or-later
"""The job file: a batch's settings in TOML, for all files, for some, for single objects (docs/batch.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from ..core.bake import IN_FILE, KINDS, check_frames
from ..core.errors import WrongUse
from ..core.frames import parse_frames
from ..core.scale_rule import SCALE_RULES


@dataclass(frozen=True)
class ObjectRule:
    """What is said of the objects whose name matches; None where nothing is."""

    match: str
    method: str | None = None
    scale: str | None = None
    bake: tuple[str, ...] | None = None

    def as_task(self) -> dict:
        bake = None if self.bake is None else list(self.bake)
        said = {"method": self.method, "scale": self.scale, "bake": bake}
        return {"match": self.match} | {key: value for key, value in said.items() if value is not None}


@dataclass(frozen=True)
class Settings:
    """What is done to the meshes of a file; None or empty where nothing is said.

    include, exclude  patterns of names of objects and of collections
    scale             name of a scale rule
    bake              kinds of bakes, written beside the copy
    bake_frames       as typed; None: those of the file's scene
    objects           later ones win
    """

    method: str | None = None
    include: tuple[str, ...] | None = None
    exclude: tuple[str, ...] | None = None
    scale: str | None = None
    bake: tuple[str, ...] | None = None
    bake_frames: str | None = None
    objects: tuple[ObjectRule, ...] = ()

    def overridden_by(self, other: Settings) -> Settings:
        return Settings(
            other.method or self.method,
            self.include if other.include is None else other.include,
            self.exclude if other.exclude is None else other.exclude,
            other.scale or self.scale,
            self.bake if other.bake is None else other.bake,
            other.bake_frames or self.bake_frames,
            self.objects + other.objects,
        )

    @property
    def kinds(self) -> tuple[str, ...]:
        """All kinds of bakes that an object of the file may ask for, each once."""
        every = [*(self.bake or ()), *(kind for rule in self.objects for kind in rule.bake or ())]
        return tuple(dict.fromkeys(every))

    def check_bakes(self) -> None:
        """Raises WrongUse where a bake can not have the frames."""
        if self.bake_frames is not None:
            for kind in self.kinds:
                check_frames(kind, sorted(set(parse_frames(self.bake_frames))))

    def as_task(self) -> dict:
        """What a task takes along, and the journal keeps."""
        return {
            "method": self.method,
            "include": list(self.include or ()),
            "exclude": list(self.exclude or ()),
            "scale": self.scale,
            "bake": list(self.bake or ()),
            "bake_frames": self.bake_frames,
            "objects": [rule.as_task() for rule in self.objects],
        }


@dataclass(frozen=True)
class FileRule:
    """Settings of the files whose path matches, as "hero*.blend" or "characters/*.blend", from the right."""

    match: tuple[str, ...]
    settings: Settings
    line: int

    def matches(self, path: PurePath) -> bool:
        """Also where a pattern is the end of the very path, which can have brackets."""
        return any(path.match(pattern) or _ends_with(path, PurePath(pattern)) for pattern in self.match)


def _ends_with(path: PurePath, end: PurePath) -> bool:
    return path.parts[-len(end.parts) :] == end.parts


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
        # Some editors begin a file with a byte order mark.
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
    return _Reader(path, text, methods).job_file(table)


SETTINGS = ("method", "scale", "include", "exclude", "bake", "bake_frames", "objects")

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
        self._known_keys(table, (), ("inputs", "out", *SETTINGS, "files"))
        return JobFile(
            inputs=tuple(str(self.base / name) for name in self._strings(table, (), "inputs") or ()),
            out=str(self.base / self._string(table, (), "out")) if "out" in table else None,
            settings=self._settings(table, ()),
            files=tuple(self._file_rule(entry, place) for entry, place in self._tables(table, (), "files")),
        )

    def _file_rule(self, table: dict, place: Place) -> FileRule:
        self._known_keys(table, place, ("match", *SETTINGS))
        self._required(table, place, "match")
        match = self._strings(table, place, "match")
        if not all(PurePath(pattern).parts for pattern in match):
            self._fail(
                (*place, "match"), f"match: expected paths such as hero*.blend, got {table['match']!r}"
            )
        return FileRule(match, self._settings(table, place), self._line(place))

    def _settings(self, table: dict, place: Place) -> Settings:
        settings = Settings(
            self._method(table, place),
            self._strings(table, place, "include"),
            self._strings(table, place, "exclude"),
            self._one_of(table, place, "scale", [rule.name for rule in SCALE_RULES]),
            self._bake(table, place),
            self._bake_frames(table, place),
            tuple(self._object_rule(entry, at) for entry, at in self._tables(table, place, "objects")),
        )
        try:
            settings.check_bakes()
        except WrongUse as error:
            self._fail((*place, "bake_frames"), str(error))
        return settings

    def _object_rule(self, table: dict, place: Place) -> ObjectRule:
        self._known_keys(table, place, ("match", "method", "scale", "bake"))
        self._required(table, place, "match")
        if len(table) == 1:
            self._fail(place, "nothing is said of these objects; expected method, scale or bake")
        return ObjectRule(
            self._string(table, place, "match"),
            self._method(table, place),
            self._one_of(table, place, "scale", [rule.name for rule in SCALE_RULES]),
            self._bake(table, place),
        )

    def _bake(self, table: dict, place: Place) -> tuple[str, ...] | None:
        kinds = self._strings(table, place, "bake")
        for kind in kinds or ():
            if kind not in KINDS:
                self._fail((*place, "bake"), f"bake: expected some of {', '.join(KINDS)}, got {kind!r}")
        in_file = [kind for kind in kinds or () if kind in IN_FILE]
        if len(in_file) > 1:
            self._fail((*place, "bake"), f"bake: an object can have one of {', '.join(in_file)}")
        return kinds

    def _bake_frames(self, table: dict, place: Place) -> str | None:
        if "bake_frames" not in table:
            return None
        text = self._string(table, place, "bake_frames")
        try:
            parse_frames(text)
        except WrongUse as error:
            self._fail((*place, "bake_frames"), f"bake_{error}")
        return text

    def _method(self, table: dict, place: Place) -> str | None:
        return self._one_of(table, place, "method", self.methods)

    def _one_of(self, table: dict, place: Place, key: str, names: Collection[str]) -> str | None:
        if key not in table:
            return None
        name = self._string(table, place, key)
        if name not in names:
            self._fail((*place, key), f"{key}: expected one of {', '.join(names)}, got {name!r}")
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
