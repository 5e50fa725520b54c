# SPDX-License-Identifier: GPL-3.0-or-later
"""What ./dev installs is locked by hashes, contains what is required, and names no address of a registry."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "requirements"
DEV = (ROOT / "dev").read_text(encoding="utf-8")
LOCKS = re.search(r'^locks="(.*)"$', DEV, re.MULTILINE)[1].split()

PINNED = re.compile(
    r"(?P<name>[\w.-]+)==(?P<version>[\w.]+)(?: ; (?P<marker>[^\\]+?))? \\\n"
    r"(?P<hashes>(?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)(?:    #.*\n)*"
)


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


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
        found.setdefault(normal(match["name"]), []).append(match["version"])
    assert end == len(text), text[end : end + 200]
    return found


def numbers(version: str) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", version)))


def fits(version: str, specifier: str) -> bool:
    """Supports the forms that are used: ==1.2, ==1.2.*, >=1.2."""
    if specifier.endswith(".*"):
        return f"{version}.".startswith(specifier.removeprefix("==")[:-1])
    if specifier.startswith(">="):
        return numbers(version) >= numbers(specifier)
    return version == specifier.removeprefix("==")


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_has_hashes_and_what_is_wanted(name):
    text = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert "--index-url" not in text
    versions = locked(text)
    for requirement in wanted(name):
        project, specifier = re.fullmatch(r"([\w-]+)(?:\[[\w-]+\])?([=>]=[\d.*]+)", requirement).groups()
        assert versions[normal(project)], requirement
        assert all(fits(version, specifier) for version in versions[normal(project)]), requirement


def test_every_file_is_one_of_a_lock():
    inputs = {path.stem for path in FOLDER.glob("*.in")}
    assert inputs == set(LOCKS)
    assert {path.stem for path in FOLDER.glob("*.txt")} == set(LOCKS)
    blenders = re.findall(r"^bpy_versions\(\) \{(.*)\}$", DEV, re.MULTILINE)[0]
    assert {
        f"bpy-{version}" for version in re.findall(r"\b\d\.\d(?=[ ;])", blenders) if version[0] in "45"
    } == {name for name in LOCKS if name.startswith("bpy-")}


def test_ranges_of_users_are_those_that_are_locked():
    def listed(file: str, table: str, key: str) -> set[str]:
        names = tomllib.loads((ROOT / file).read_text(encoding="utf-8"))[table][key]
        return {name for name in names if not name.startswith(("bpy", "sinew-skinning"))}

    addon = listed("addon/pyproject.toml", "project", "dependencies")
    addon |= listed("addon/pyproject.toml", "build-system", "requires")
    assert addon <= set(wanted("tests"))
    assert listed("pyproject.toml", "build-system", "requires") == set(wanted("build"))


def test_environments_are_made_of_locks():
    made = re.findall(r"^ +make_environment (.*)$", DEV, re.MULTILINE)
    assert len(made) >= 6
    # Packages that are only compared in benchmarks are not locked.
    assert [line for line in made if "--locked" not in line] == [
        '.venvs/bench "$everyday_python" "${bench_requirements[@]}"'
    ]
    assert "--require-hashes" in DEV


@pytest.mark.parametrize(
    "text", ["six==1.0\n", "six>=1.0 \\\n    --hash=sha256:00\n", "--index-url https://example.org\n"]
)
def test_what_is_no_lock_is_seen(text):
    with pytest.raises(AssertionError):
        locked(text)
