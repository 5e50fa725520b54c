# SPDX-License-Identifier: GPL-3.0-or-later
"""What the page is made of. report.json holds exactly this."""

from __future__ import annotations

from dataclasses import dataclass, field

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class Row:
    """One line of a table.

    printed, ours  the numbers that the table's `columns` name; None where there is none
    agrees         None where nothing is printed to agree with
    why            why not, where it does not
    more           what the table's `more_columns` name
    """

    name: str
    printed: Numbers | None
    ours: Numbers | None
    agrees: bool | None = None
    why: str = ""
    more: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Fact:
    """What the report says that its table or figure shows, and what ours shows, with the numbers behind."""

    says: str
    ours: str
    agrees: bool
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """A table of the report.

    number     as there
    columns    what each of the numbers is
    tolerance  a sentence: when printed and ours agree
    decimals   digits shown after the point
    facts      what the report concludes from it
    notes      what else there is to say
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
    """caption, and the picture itself: an SVG as text or a PNG as bytes."""

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
    """A conclusion or an open question of the report, and what our numbers say to it."""

    question: str
    answer: str


@dataclass(frozen=True)
class Page:
    """studies: the numbers of studies.py that the answers speak of."""

    version: str
    machine: dict[str, str]
    quick: bool
    tables: tuple[Table, ...]
    figures: tuple[Figure, ...]
    answers: tuple[Answer, ...]
    studies: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
