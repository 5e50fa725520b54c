# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the locks of what ./dev installs: by hashes, with all that is required, naming no registry."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "requirements"
LOCKS = sorted(path.stem for path in FOLDER.glob("*.in"))

PINNED = re.compile(
    r"(?P<name>[\w.-]+)==(?P<version>[\w.]+)(?: ; (?P<marker>[^\\]+?))? \\\n"
    r"(?P<hashes>(?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)(?:    #.*\n)*"
)


def wanted(name: str) -> list[str]:
    """The requirements of NAME.in and of what it includes."""
    found = []
    for line in (FOLDER / f"{name}.in").read_text(encoding="utf-8").splitlines():
        if line.startswith("-r "):
            found += wanted(line.removeprefix("-r ").removesuffix(".in"))
        elif line and not line.startswith("#"):
            found.append(line)
    return found


def locked(text: str) -> dict[str, list[str]]:
    """Versions by name; several if they differ by a marker. Anything else in the text is an error."""
    found: dict[str, list[str]] = {}
    end = 0
    for match in PINNED.finditer(text):
        assert match.start() == end, text[end : match.start()]
        end = match.end()
        found.setdefault(canonicalize_name(match["name"]), []).append(match["version"])
    assert end == len(text), text[end : end + 200]
    return found


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_has_hashes_and_what_is_wanted(name):
    text = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert "--index-url" not in text
    versions = locked(text)
    for requirement in map(Requirement, wanted(name)):
        found = versions[canonicalize_name(requirement.name)]
        assert all(requirement.specifier.contains(version) for version in found), requirement


def test_every_blender_and_every_installation_has_a_lock():
    assert {path.stem for path in FOLDER.glob("*.txt")} == set(LOCKS)
    listed = (ROOT / "tools/blenders.py").read_text(encoding="utf-8")
    blenders = re.search(r"^BLENDERS = \{(.*)\}$", listed, re.MULTILINE)[1]
    assert {f"bpy-{version}" for version in re.findall(r'"([\d.]+)":', blenders)} <= set(LOCKS)
    # Without an option, uv checks the hashes that a file has; pip wants one of each.
    assert "--require-hashes" in (ROOT / "dev").read_text(encoding="utf-8")
    assert "--no-verify-hashes" not in (ROOT / "noxfile.py").read_text(encoding="utf-8")


def test_ranges_of_users_are_those_that_are_locked():
    def listed(file: str, table: str, key: str) -> set[str]:
        names = tomllib.loads((ROOT / file).read_text(encoding="utf-8"))[table][key]
        return {name for name in names if not name.startswith(("bpy", "sinew-skinning"))}

    addon = listed("addon/pyproject.toml", "project", "dependencies")
    addon |= listed("addon/pyproject.toml", "build-system", "requires")
    assert addon <= set(wanted("tests"))
    assert listed("pyproject.toml", "build-system", "requires") == set(wanted("build"))
