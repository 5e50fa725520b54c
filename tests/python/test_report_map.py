# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/report.md has every part of Smith 2013, and what it names in Sinew exists. Only reads sources."""

from __future__ import annotations

import ast
import importlib
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "report.md"
TEXT = PAGE.read_text(encoding="utf-8")

sys.path.insert(0, str(ROOT / "docs"))
make_reference = importlib.import_module("make_reference")
sys.path.remove(str(ROOT / "docs"))

# What Smith 2013 numbers. Its equations have no numbers.
SECTIONS = [
    "2.1",
    "2.1.1",
    "2.2",
    "2.2.1",
    "2.2.2",
    "2.2.3",
    "2.3",
    "2.3.1",
    "2.3.2",
    "3.1",
    "3.2",
    "3.2.1",
    "3.2.2",
    "3.2.3",
    "3.3",
    "3.4",
    "3.4.1",
    "3.4.2",
    "3.4.3",
    "3.5",
    "3.5.1",
    "3.5.2",
    "3.5.3",
    "3.6",
    "3.6.1",
    "3.6.2",
    "3.6.3",
    "4.1",
]
PARTS = {
    "chapter": ["1", "2", "3", "4", "5"],
    "section": SECTIONS,
    "algorithm": ["1", "2", "3"],
    "table": [f"3.{number}" for number in range(1, 11)],
    "figure": ["2.1", "2.2", *(f"3.{number}" for number in range(1, 12))],
}
NUMBERED = re.compile(
    r"\b(chapter|section|algorithm|table|figure)s? (\d+(?:\.\d+)*(?:(?:, | and | to )\d+(?:\.\d+)*)*)",
    re.IGNORECASE,
)


def numbered(text: str) -> set[tuple[str, str]]:
    """The parts that `text` names, ("table", "3.1") and so on; the two ends of a range."""
    return {
        (kind.lower(), number)
        for kind, numbers in NUMBERED.findall(text)
        for number in re.split(r", | and | to ", numbers)
    }


def rows() -> list[list[str]]:
    """The cells of the tables that list where each part is."""
    chapters = TEXT[TEXT.index("## Where each part is") : TEXT.index("## Misprints")]
    lines = [line for line in chapters.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_a_list_of_numbers_is_read_whole():
    assert numbered("Section 2.1, Figures 3.6, 3.7 and 3.8; tables 3.1 to 3.9") == {
        ("section", "2.1"),
        *(("figure", number) for number in ("3.6", "3.7", "3.8")),
        ("table", "3.1"),
        ("table", "3.9"),
    }


@pytest.mark.parametrize("kind", PARTS)
def test_every_part_has_its_row(kind):
    found = {number for row in rows() for what, number in numbered(row[0]) if what == kind}
    # For a chapter with sections, the sections say what it has.
    missing = set(PARTS[kind]) - found - ({"2"} if kind == "chapter" else set())
    assert not missing


def test_every_row_says_where():
    for row in rows():
        assert len(row) == 3, row
        assert all(row), row


def test_no_part_is_named_that_the_report_has_not():
    for kind, number in numbered(TEXT):
        assert number in PARTS[kind], (kind, number)


def test_citations_in_the_sources_name_parts_of_the_report():
    cited = []
    for folder in ("native", "addon", "experiments", "tests"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix not in {".h", ".cpp", ".py", ".pyi"}:
                continue
            for kind, number in re.findall(
                r"Smith 2013, (chapter|section|algorithm|table|figure)s? (\d+(?:\.\d+)*)",
                path.read_text(encoding="utf-8"),
                re.IGNORECASE,
            ):
                assert number in PARTS[kind.lower()], (path, kind, number)
                cited.append(number)
    assert len(cited) > 30


# --- Names in Sinew


def links() -> set[str]:
    return {link.partition("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", TEXT)}


def paths() -> set[str]:
    """Paths in the repository in code marks."""
    folders = "addon|bench|blend_files|docs|experiments|native|tests"
    return set(re.findall(rf"`((?:{folders})/[\w./]*)`", TEXT))


def test_links_lead_somewhere():
    # The site generates these from the Python package.
    made = {"python.md"}
    found = links() - made
    assert len(found) > 25
    for link in found:
        assert (PAGE.parent / link).is_file(), link


def test_paths_are_there():
    assert len(paths()) > 8
    for path in paths():
        assert (ROOT / path).exists(), path


def assigned(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """The names that statements define; for an import, its names."""
    found: dict[str, ast.stmt] = {}
    for node in body:
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found[name] = node
            case ast.Assign(targets=targets):
                found |= {target.id: node for target in targets if isinstance(target, ast.Name)}
            case ast.AnnAssign(target=ast.Name(id=name)):
                found[name] = node
            case ast.ImportFrom(names=names):
                found |= {alias.asname or alias.name: node for alias in names}
    return found


def public(file: str) -> set[str]:
    """The names that a file of the package defines and lists."""
    tree = make_reference.parsed(file)
    return set(make_reference.exported(tree)) & assigned(tree.body).keys()


def is_of_sinew(name: str) -> bool:
    """Whether sinew.NAME is public."""
    first, *rest = name.split(".")
    if first not in public("__init__.py"):
        return False
    if not rest:
        return True
    if len(rest) > 1:
        return False
    if (make_reference.PACKAGE / f"{first}.py").exists():
        return rest[0] in public(f"{first}.py")
    known = assigned(make_reference.parsed("_native.pyi").body).get(first)
    return isinstance(known, ast.ClassDef) and rest[0] in assigned(known.body)


def test_names_of_python_are_found_where_they_are():
    assert is_of_sinew("Skeleton.root_relative")
    assert is_of_sinew("interpolate.METHODS")
    assert is_of_sinew("dual_quat.compose")
    for wrong in (
        "Skelet",
        "Skeleton.no",
        "dual_quat.no",
        "methods.no",
        "interpolate.METHODS.no",
        "ArrayLike",
    ):
        assert not is_of_sinew(wrong)


def test_names_of_python_are_there():
    found = set(re.findall(r"`sinew\.([\w.]+)`", TEXT))
    assert len(found) > 20
    for name in found:
        assert is_of_sinew(name), name


def test_names_of_cpp_are_in_the_files_beside_them():
    checked = 0
    for row in rows():
        where = row[2]
        files = [PAGE.parent / link for link in re.findall(r"\]\((\.\./[^)]+)\)", where)]
        sources = "".join(path.read_text(encoding="utf-8") for path in files)
        for name in re.findall(r"`(\w+)(?:\(\))?`", where):
            assert re.search(rf"\b{name}\b", sources), (row[0], name)
            checked += 1
    assert checked > 35
