# SPDX-License-Identifier: GPL-3.0-or-later
"""The data of the page, which report.json contains exactly."""

from __future__ import annotations

from dataclasses import dataclass, field

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class Row:
    """One line of a table.

    printed, ours  the numbers that the table's `columns` name; None where there are none
    agrees         None where nothing is printed to compare with
    why            the reason where it does not agree
    more           the values that the table's `more_columns` name
    """

    name: str
    printed: Numbers | None
    ours: Numbers | None
    agrees: bool | None = None
    why: str = ""
    more: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Fact:
    """What the report says about its table or figure, and what ours shows, with the underlying numbers."""

    says: str
    ours: str
    agrees: bool
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """A table of the report.

    number     as in the report
    columns    the meaning of each number
    tolerance  a sentence: when printed and ours agree
    decimals   digits shown after the point
    facts      the report's conclusions from it
    notes      further remarks
    missing    why it could not be measured here and how to, or None
    """

    number: str
    title: str
    columns: tuple[str, ...]
    tolerance: str
    decimals: int
    rows: tuple[Row, ...] = ()
    more_columns: tuple[str, ...] = ()
    facts: tuple[Fact, ...] = ()
    notes: tuple[str, ...] = ()
    missing: str | None = None


@dataclass(frozen=True)
class Picture:
    """A caption, and the picture itself: an SVG as text or a PNG as bytes."""

    caption: str
    content: str | bytes = field(repr=False)


@dataclass(frozen=True)
class Figure:
    number: str
    title: str
    pictures: tuple[Picture, ...] = ()
    facts: tuple[Fact, ...] = ()
    notes: tuple[str, ...] = ()
    missing: str | None = None


@dataclass(frozen=True)
class Answer:
    """A conclusion or an open question of the report, and what our numbers say about it."""

    question: str
    answer: str


@dataclass(frozen=True)
class Page:
    """studies: the numbers of studies.py that the answers refer to."""

    version: str
    machine: dict[str, str]
    quick: bool
    tables: tuple[Table, ...]
    figures: tuple[Figure, ...]
    answers: tuple[Answer, ...]
    studies: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
