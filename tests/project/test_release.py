# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the version, which all files share, and a release, which is whole or leaves all as it was."""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import release

ROOT = Path(__file__).resolve().parents[2]
DATE = "2031-02-03"
CHANGES = f"""# Changelog

{release.UNRELEASED}

### Added

- A thing.

## [0.3.0] - 2030-01-02

### Fixed

- Another.

## [0.2.0] - 2029-01-02

- The first.
"""


@pytest.fixture
def texts() -> dict[str, str]:
    return release.read_texts(ROOT)


def test_a_new_version_is_set_everywhere_and_changes_nothing_else(texts):
    assert tomllib.loads(texts["pyproject.toml"])["project"]["version"] == release.version_in(texts)
    after = release.with_version(texts, "9.8.7", DATE)
    assert release.version_in(after) == "9.8.7"
    for name, text in texts.items():
        changed = set(after[name].splitlines()) - set(text.splitlines())
        assert len(changed) == {"addon/pyproject.toml": 2, "CITATION.cff": 2, "CHANGELOG.md": 0}.get(name, 1)
        assert all("9.8.7" in line or line == f"date-released: {DATE}" for line in changed)
    # The next release replaces the date.
    assert release.with_version(after, "9.8.8", "2032-01-01")["CITATION.cff"].count("date-released") == 1


def test_nothing_else_names_the_version(texts):
    """Other files that a release would have to change."""
    named = re.compile(
        rf"sinew[^\n]{{0,20}}(?<![\d.]){re.escape(release.version_in(texts))}(?![\d.])", re.IGNORECASE
    )
    tracked = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout
    files = [name for name in tracked.split() if re.search(r"\.(py|md|h|cpp|txt|toml|html)$", name)]
    found = {name for name in files if named.search((ROOT / name).read_text(encoding="utf-8"))}
    # Results keep the version that was measured.
    assert found <= {*release.FILES, "docs/results.md"}


@pytest.mark.parametrize(
    "wrong", ["", "1", "1.2", "v1.2.3", "1.2.3rc1", "01.2.3", "1.2.3.4", "1.2.3\n", "1\u0662.0.0"]
)
def test_what_is_no_version_is_refused(wrong):
    with pytest.raises(SystemExit, match="is not a version"):
        release.numbers(wrong)


def test_what_is_compiled_in_has_a_notice():
    declared = re.findall(
        r"FetchContent_Declare\((\w+)", (ROOT / "native/cmake/dependencies.cmake").read_text()
    )
    # Only for tests and benchmarks, which are not distributed.
    compiled_in = {*declared, "pybind11"} - {"googletest", "benchmark"}
    # From zig, whose C and C++ libraries tools/cross_build.py links.
    compiled_in |= {"llvm", "mingw-w64"}
    assert len(compiled_in) >= 4
    notices = (ROOT / "NOTICES.md").read_text(encoding="utf-8")
    listed = {name.lower() for name in re.findall(r"^\| ([\w-]+) \|.*https://", notices, re.MULTILINE)}
    assert listed == compiled_in


# --- The changelog


def test_the_changelog_has_the_form_that_a_release_needs(texts):
    changelog = texts["CHANGELOG.md"]
    headings = re.findall(r"^## .*$", changelog, re.MULTILINE)
    assert headings[0] == release.UNRELEASED
    assert len(headings) == 1 + len(release.released_versions(changelog))
    kinds = set(re.findall(r"^### (.*)$", changelog, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


# --- A complete release, in its own repository

# Stands in for the build: a zip with a wheel in it, with the name that ./dev package would give it.
PACKAGES = """#!/usr/bin/env python3
import re, sys, zipfile
assert sys.argv[1:] == ["package"]
version = re.search('^version = "(.*)"', open("pyproject.toml").read(), re.M)[1]
with zipfile.ZipFile(f"dist/sinew-{version}.zip", "w") as archive:
    archive.writestr(f"wheels/sinew_skinning-{version}-cp311-cp311-linux_x86_64.whl", b"wheel")
    archive.writestr("__init__.py", b"")
open(f"dist/sinew-{version}.cdx.json", "w").write("{}")
print(f"dist/sinew-{version}.zip")
"""
BILL = "sinew-7.0.0.cdx.json"
SKINNING = "sinew_skinning-7.0.0-cp311-cp311-linux_x86_64.whl"


@pytest.fixture
def checkout(tmp_path):
    root = tmp_path / "checkout"
    for name in [*release.FILES, "tools/release.py"]:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, root / name)
    (root / "CHANGELOG.md").write_text(CHANGES, encoding="utf-8")
    (root / "dist").mkdir()
    (root / ".gitignore").write_text("/dist/\n")
    write_dev(root, PACKAGES)
    git(root, "init", "--quiet", "--initial-branch=main")
    commit(root)
    return root


def write_dev(root: Path, text: str) -> None:
    (root / "dev").write_text(text)
    (root / "dev").chmod(0o755)


def git(root: Path, *words: str) -> str:
    identity = ["-c", "user.name=T", "-c", "user.email=t@example.org", "-c", "commit.gpgsign=false"]
    return subprocess.run(
        ["git", *identity, *words], cwd=root, check=True, capture_output=True, text=True
    ).stdout


def commit(root: Path) -> None:
    git(root, "add", "--all")
    git(root, "commit", "--quiet", "--message", "all")


def run(root: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-I", "tools/release.py", *options],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )


def left_in(root: Path) -> dict[str, bytes]:
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and ".git" not in path.parts
    }


def test_a_release(checkout):
    done = run(checkout, "7.0.0")
    assert done.returncode == 0, done.stderr
    folder = checkout / "dist" / "release-7.0.0"
    assert {path.name for path in folder.iterdir()} == {
        *("sinew-7.0.0.zip", BILL, SKINNING, "NOTES.md", "SHA256SUMS")
    }
    assert (folder / "NOTES.md").read_text() == "### Added\n\n- A thing.\n"
    sums = dict(line.split("  ")[::-1] for line in (folder / "SHA256SUMS").read_text().splitlines())
    assert sums == {
        name: hashlib.sha256((folder / name).read_bytes()).hexdigest()
        for name in ("sinew-7.0.0.zip", BILL, SKINNING, "NOTES.md")
    }
    assert (folder / SKINNING).read_bytes() == b"wheel"
    assert release.version_in(release.read_texts(checkout)) == "7.0.0"
    changed = {line[3:] for line in git(checkout, "status", "--porcelain").splitlines()}
    assert changed == set(release.FILES)
    assert len(git(checkout, "log", "--oneline").splitlines()) == 1
    assert git(checkout, "tag") == ""
    assert "git tag --sign v7.0.0" in done.stdout
    # After the commit, its notes can be printed for publishing.
    assert run(checkout, "--notes", "7.0.0").stdout == "### Added\n\n- A thing.\n"
    assert "this is 7.0.0, not 7.0.1" in run(checkout, "--notes", "7.0.1").stderr
    # The same release again is refused.
    commit(checkout)
    again = run(checkout, "7.0.0")
    assert again.returncode == 1
    assert "dist/release-7.0.0 is there already" in again.stderr
    assert "has nothing below" in again.stderr


def obstruct_tree(root):
    (root / "new.txt").write_text("new")


def obstruct_build(root):
    write_dev(root, "#!/bin/sh\necho half >dist/half\nexit 3\n")
    commit(root)


@pytest.mark.parametrize(
    ("obstruct", "said"),
    [
        (obstruct_tree, "release: the checkout has changes: commit them, or take them back."),
        (obstruct_build, "release: ./dev package failed; the files have their old text again."),
    ],
)
def test_what_fails_leaves_all_as_it_was(checkout, obstruct, said):
    obstruct(checkout)
    before = left_in(checkout)
    done = run(checkout, "7.0.0")
    assert done.returncode == 1
    assert done.stderr.strip() == said
    after = left_in(checkout)
    assert {name: data for name, data in after.items() if not name.startswith("dist/")} == before
    assert not [name for name in after if "release-" in name]
