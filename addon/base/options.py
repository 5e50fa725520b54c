# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that an operator of Blender's and a command of `sinew` share: fields of dataclasses, each with what
a user is told of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeVar

Options = TypeVar("Options")
Choice = tuple[str, str, str] | tuple[str, str, str, int]


@dataclass(frozen=True)
class Shown:
    """What a user is told of an option.

    label      in Blender
    text       the tooltip, and the help of the command
    least      of a number
    soft_most  where the slider of a number ends
    kind       "percent" for shares from 0 to 100
    choices    name, label, text and the number in files of each
    """

    label: str
    text: str
    least: int = 0
    soft_most: int | None = None
    kind: Literal["", "percent"] = ""
    choices: Sequence[Choice] = ()

    @property
    def names(self) -> list[str]:
        return [choice[0] for choice in self.choices]


def option(default: object, label: str, text: str, **shown: Any) -> Any:
    """A field of a dataclass of options. shown: as in Shown"""
    return field(default=default, metadata={"shown": Shown(label, text, **shown)})


def same_option(of: type, name: str) -> Any:
    """A field that is the same as that of another dataclass."""
    (same,) = (each for each in fields(of) if each.name == name)
    return field(default=same.default, metadata=same.metadata)


def options_of(cls: type) -> dict[str, tuple[Any, Shown]]:
    """By the names of a dataclass's options, their defaults and what a user is told of them."""
    return {each.name: (each.default, each.metadata["shown"]) for each in fields(cls) if each.metadata}


def read_options(cls: type[Options], given: object, **others: object) -> Options:
    """A dataclass of options as the attributes of `given` say: an operator, or a command's arguments.

    others  fields that are no options
    """
    return cls(**{name: getattr(given, name) for name in options_of(cls)}, **others)
