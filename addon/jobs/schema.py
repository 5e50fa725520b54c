# SPDX-License-Identifier: GPL-3.0-or-later
"""A schema for the tables of a TOML file, used for reading, error messages and documents."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ..core.errors import WrongUse

Position = tuple[str | int, ...]
"""The path to a value in a file: keys from the top, and an index for each entry of an array of tables."""


class SchemaError(Exception):
    """A value that the schema does not allow.

    position  of the value; from the top of the file when read() raises it
    sentence  what was expected and what was found
    """

    def __init__(self, position: Position, sentence: str) -> None:
        super().__init__(sentence)
        self.position, self.sentence = position, sentence


@dataclass(frozen=True)
class Kind:
    """The type of a value.

    wanted  a short description for documents
    read    converts and checks a value; raises WrongUse with a sentence that follows the name of the key
    """

    wanted: str
    read: Callable[[Any], Any]


@dataclass(frozen=True)
class Key:
    """One key of a table.

    kind  of its value; a Table for a list of tables, as in [[files]]
    help  one sentence for documents
    """

    name: str
    kind: Kind | Table
    help: str
    required: bool = False


@dataclass(frozen=True)
class Table:
    """The keys of one table, in the order in which they are documented.

    check  raises SchemaError, with a position relative to this table, where keys contradict each other
    """

    keys: tuple[Key, ...]
    check: Callable[[Mapping[str, Any]], None] = lambda _values: None


@dataclass(frozen=True)
class Entry:
    """A table as read.

    values  by key, only the keys of the file. A list of tables is a list of entries.
    """

    position: Position
    values: Mapping[str, Any]


def read(table: Mapping[str, Any], schema: Table, position: Position = ()) -> Entry:
    """Reads a table. Raises SchemaError for the first key, in the order of the file, that the schema does not
    allow."""
    known = {key.name: key for key in schema.keys}
    for name in table:
        if name not in known:
            raise SchemaError((*position, name), f"{name}: no such key; expected one of {', '.join(known)}")
    for key in schema.keys:
        if key.required and key.name not in table:
            raise SchemaError(position, f"{key.name} is missing")
    values = {name: _read_value(value, known[name], (*position, name)) for name, value in table.items()}
    try:
        schema.check(values)
    except SchemaError as error:
        raise SchemaError((*position, *error.position), error.sentence) from None
    return Entry(position, values)


def _read_value(value: object, key: Key, position: Position) -> object:
    if isinstance(key.kind, Kind):
        try:
            return key.kind.read(value)
        except WrongUse as error:
            raise SchemaError(position, f"{key.name}: {error}") from None
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        header = ".".join(step for step in position if isinstance(step, str))
        raise SchemaError(position, f"{key.name}: expected entries that begin with [[{header}]]")
    return [read(entry, key.kind, (*position, number)) for number, entry in enumerate(value)]


# --- Kinds


def _read_text(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise WrongUse(f"expected text in quotes, got {value!r}")
    return value


def _read_texts(value: object) -> tuple[str, ...]:
    values = value if isinstance(value, list) else [value]
    if not all(isinstance(one, str) and one for one in values):
        raise WrongUse(f'expected a list such as ["a*", "b"], got {value!r}')
    return tuple(values)


TEXT = Kind("text", _read_text)
TEXTS = Kind("text or a list", _read_texts)


def one_of(names: Collection[str], wanted: str = "") -> Kind:
    """Returns a kind of text that is one of `names`."""

    def read_name(value: object) -> str:
        name = _read_text(value)
        if name not in names:
            raise WrongUse(f"expected one of {', '.join(names)}, got {name!r}")
        return name

    return Kind(wanted or f"one of {', '.join(names)}", read_name)


def some_of(names: Collection[str]) -> Kind:
    """Returns a kind of one text or a list, each one of `names`."""

    def read_names(value: object) -> tuple[str, ...]:
        found = _read_texts(value)
        for name in found:
            if name not in names:
                raise WrongUse(f"expected some of {', '.join(names)}, got {name!r}")
        return found

    return Kind(f"some of {', '.join(names)}", read_names)


def checked(kind: Kind, check: Callable[[Any], None], wanted: str = "") -> Kind:
    """Returns `kind`, restricted to values for which `check` does not raise WrongUse."""

    def read_checked(value: object) -> object:
        kept = kind.read(value)
        check(kept)
        return kept

    return Kind(wanted or kind.wanted, read_checked)


# --- Documents


def rows(schema: Table) -> list[tuple[str, str, str, str]]:
    """Returns each key once: its name, the tables that can have it, the values that it takes, its help."""
    headers: dict[Key, list[str]] = {}
    for key, header in _keys_below(schema, ""):
        headers.setdefault(key, []).append(header)
    return [(key.name, ", ".join(found), _wanted(key), key.help) for key, found in headers.items()]


def _keys_below(schema: Table, header: str) -> Iterator[tuple[Key, str]]:
    for key in schema.keys:
        yield key, f"[[{header}]]" if header else "top"
    for key in schema.keys:
        if isinstance(key.kind, Table):
            yield from _keys_below(key.kind, f"{header}.{key.name}".lstrip("."))


def _wanted(key: Key) -> str:
    wanted = key.kind.wanted if isinstance(key.kind, Kind) else "tables"
    return f"{wanted}; required" if key.required else wanted
