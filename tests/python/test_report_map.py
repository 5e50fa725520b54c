# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects docs/report.md, which lists where each part of Smith 2013 is: no part is left out, and what it
names is there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "report.md").read_text(encoding="utf-8")
# What Smith 2013 numbers. Its equations have no numbers.
SECTIONS = (
    "2.1 2.1.1 2.2 2.2.1 2.2.2 2.2.3 2.3 2.3.1 2.3.2 3.1 3.2 3.2.1 3.2.2 3.2.3 3.3 3.4 3.4.1 3.4.2 3.4.3 3.5 "
    "3.5.1 3.5.2 3.5.3 3.6 3.6.1 3.6.2 3.6.3 4.1"
)
PARTS = {
    "chapter": {"1", "3", "4", "5"},  # the sections of chapter 2 say what it has
    "section": set(SECTIONS.split()),
    "algorithm": {"1", "2", "3"},
    "table": {f"3.{number}" for number in range(1, 11)},
    "figure": {"2.1", "2.2", *(f"3.{number}" for number in range(1, 12))},
}
NUMBERED = re.compile(
    r"\b(chapter|section|algorithm|table|figure)s? (\d+(?:\.\d+)*(?:(?:, | and )\d+(?:\.\d+)*)*)",
    re.IGNORECASE,
)


def rows() -> list[list[str]]:
    """The cells of the tables that list where each part is."""
    chapters = TEXT[TEXT.index("## Where each part is") : TEXT.index("## Misprints")]
    lines = [line for line in chapters.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_every_part_has_its_row():
    found: dict[str, set[str]] = {}
    for row in rows():
        assert len(row) == 3, row
        assert all(row), row
        for kind, numbers in NUMBERED.findall(row[0]):
            found.setdefault(kind.lower(), set()).update(re.split(r", | and ", numbers))
    assert found == PARTS


def test_what_it_names_is_there():
    """Links to other pages are checked where the site is built."""
    folders = "addon|bench|blend_files|docs|experiments|native|tests"
    for path in re.findall(rf"(?:`|\(\.\./)((?:{folders})/[\w./]*)", TEXT):
        assert (ROOT / path).exists(), path
    for row in rows():
        files = re.findall(r"\]\(\.\./([^)]+)\)", row[2])
        sources = "".join((ROOT / path).read_text(encoding="utf-8") for path in files)
        for name in re.findall(r"`(\w+)(?:\(\))?`", row[2]):
            assert re.search(rf"\b{name}\b", sources), (row[0], name)
