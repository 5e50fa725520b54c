# SPDX-License-Identifier: GPL-3.0-or-later
"""The job file: a batch's settings in TOML, for all files, for some files, for single objects
(docs/batch.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from pathlib import Path, PurePath
from typing import Any

from ..core.errors import WrongUse
from .job_schema import check_bakes, job_schema
from .schema import Position, SchemaError, read


@dataclass(frozen=True)
class ObjectRule:
    """Settings of the objects whose name matches; None for what the file does not set."""

    match: str
    method: str | None = None
    scale: str | None = None
    set: tuple[str, ...] | None = None
    bake: tuple[str, ...] | None = None

    def as_task(self) -> dict:
        bake = None if self.bake is None else list(self.bake)
        parameters = None if self.set is None else list(self.set)
        given = {"method": self.method, "scale": self.scale, "set": parameters, "bake": bake}
        return {"match": self.match} | {key: value for key, value in given.items() if value is not None}


@dataclass(frozen=True)
class Settings:
    """Settings of a file's meshes; None or empty where nothing is set.

    include, exclude  patterns of names of objects and of collections
    scale             name of a scale rule
    set               parameters as NAME=VALUE; later ones override earlier ones
    bake              kinds of bakes, written beside the copy
    bake_frames       as typed; None: those of the file's scene
    objects           later rules override earlier ones
    """

    method: str | None = None
    include: tuple[str, ...] | None = None
    exclude: tuple[str, ...] | None = None
    scale: str | None = None
    set: tuple[str, ...] = ()
    bake: tuple[str, ...] | None = None
    bake_frames: str | None = None
    objects: tuple[ObjectRule, ...] = ()

    def overridden_by(self, other: Settings) -> Settings:
        return Settings(
            other.method or self.method,
            self.include if other.include is None else other.include,
            self.exclude if other.exclude is None else other.exclude,
            other.scale or self.scale,
            self.set + other.set,
            self.bake if other.bake is None else other.bake,
            other.bake_frames or self.bake_frames,
            self.objects + other.objects,
        )

    @property
    def kinds(self) -> tuple[str, ...]:
        """All kinds of bakes of the file's objects, each once."""
        every = [*(self.bake or ()), *(kind for rule in self.objects for kind in rule.bake or ())]
        return tuple(dict.fromkeys(every))

    def check_bakes(self) -> None:
        """Raises WrongUse where a bake is not possible for the frames."""
        check_bakes(self.kinds, self.bake_frames)

    def as_task(self) -> dict:
        """Returns the settings as JSON, for tasks and for the journal."""
        return {
            "method": self.method,
            "include": list(self.include or ()),
            "exclude": list(self.exclude or ()),
            "scale": self.scale,
            "set": list(self.set),
            "bake": list(self.bake or ()),
            "bake_frames": self.bake_frames,
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
        return any(path.match(pattern) or _ends_with(path, PurePath(pattern)) for pattern in self.match)


def _ends_with(path: PurePath, end: PurePath) -> bool:
    return path.parts[-len(end.parts) :] == end.parts


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


def read_job_file(path: Path, methods: Collection[str]) -> JobFile:
    """Reads a job file. Raises WrongUse, with file and line, for anything that the schema does not allow."""
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
        values = read(table, job_schema(methods)).values
    except SchemaError as error:
        raise WrongUse(f"{path}:{_line_of(text, error.position)}: {error.sentence}") from None
    base = path.resolve().parent
    return JobFile(
        inputs=tuple(str(base / name) for name in values.get("inputs", ())),
        out=str(base / values["out"]) if "out" in values else None,
        settings=_settings(values),
        files=tuple(
            FileRule(entry.values["match"], _settings(entry.values), _line_of(text, entry.position))
            for entry in values.get("files", ())
        ),
    )


def _settings(values: Mapping[str, Any]) -> Settings:
    """Returns the settings in a table, which can have other keys as well. Keys and fields have the same
    names."""
    own = {field.name: values[field.name] for field in fields(Settings) if field.name in values}
    own["objects"] = tuple(ObjectRule(**entry.values) for entry in values.get("objects", ()))
    return Settings(**own)


def _line_of(text: str, position: Position) -> int:
    """Returns the line, from 1, where the value at `position` begins."""
    return _line_where(text, lambda table: _has(table, position))


def _line_where(text: str, is_true: Callable[[dict], bool]) -> int:
    """Returns the line of the first statement that makes `is_true` hold. tomllib reports no positions, so
    longer and longer beginnings of the file are parsed; the first one for which it holds ends with that
    statement."""
    lines = text.splitlines()
    begin = 0
    for end in range(1, len(lines) + 1):
        try:
            table = tomllib.loads("\n".join(lines[:end]))
        except tomllib.TOMLDecodeError:
            continue
        if is_true(table):
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
