#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prepares a release: sets its version, dates its changes, builds it, writes notes and checksums.

Changes nothing public, and makes no commit and no tag; it prints the commands for these at the end.
Obstacles are found before anything is written; if the build fails, the files get their old text back.
"""

from __future__ import annotations

import argparse
import datetime
import hashlib
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
# The form of version that CMake, pip and Blender's manifest all accept.
VERSION = r"(?:0|[1-9][0-9]*)\.(?:0|[1-9][0-9]*)\.(?:0|[1-9][0-9]*)"
CHANGELOG = "CHANGELOG.md"
CITATION = "CITATION.cff"
UNRELEASED = "## [Unreleased]"


class Place(NamedTuple):
    """The position of the version in a file: the one group of the pattern's one match."""

    file: str
    pattern: str


PLACES = (
    Place("CMakeLists.txt", r"^project\(sinew VERSION (\S+) "),
    Place("pyproject.toml", r'^version = "([^"]*)"$'),
    Place("addon/pyproject.toml", r'^version = "([^"]*)"$'),
    Place("addon/pyproject.toml", r'"sinew-skinning==([^"]*)"'),
    Place("addon/blender_manifest.toml", r'^version = "([^"]*)"$'),
    Place(CITATION, r"^version: (\S+)$"),
)
FILES = tuple(dict.fromkeys([*(place.file for place in PLACES), CHANGELOG]))

Texts = Mapping[str, str]


def fail(message: str) -> SystemExit:
    return SystemExit(f"release: {message}")


def read_texts(root: Path) -> dict[str, str]:
    return {name: (root / name).read_text(encoding="utf-8") for name in FILES}


def numbers(version: str) -> tuple[int, ...]:
    """The version as numbers, for comparison."""
    if not re.fullmatch(VERSION, version):
        raise fail(f"{version} is not a version: three numbers with dots between, such as 1.4.0.")
    return tuple(map(int, version.split(".")))


# --- The version in files


def match_of(place: Place, text: str) -> re.Match[str]:
    found = list(re.finditer(place.pattern, text, re.MULTILINE))
    if len(found) != 1:
        raise fail(f"{place.file} has {len(found)} places like {place.pattern} instead of one.")
    return found[0]


def version_in(texts: Texts) -> str:
    """The version, which must be the same in all files."""
    named = {(place.file, match_of(place, texts[place.file])[1]) for place in PLACES}
    versions = {version for _file, version in named}
    if len(versions) != 1:
        listed = ", ".join(f"{version} in {file}" for file, version in sorted(named))
        raise fail(f"the files name several versions: {listed}.")
    return versions.pop()


def with_version(texts: Texts, version: str, date: str) -> dict[str, str]:
    result = dict(texts)
    for place in PLACES:
        text = result[place.file]
        start, end = match_of(place, text).span(1)
        result[place.file] = text[:start] + version + text[end:]
    undated = re.sub(r"^date-released: .*\n", "", result[CITATION], flags=re.MULTILINE)
    result[CITATION] = re.sub(
        r"^version: .*$", rf"\g<0>\ndate-released: {date}", undated, count=1, flags=re.MULTILINE
    )
    return result


# --- CHANGELOG.md


def section(changelog: str, heading: str) -> tuple[int, int]:
    """The positions at which the text below a heading begins and ends."""
    found = list(re.finditer(rf"^{re.escape(heading)}(?: - .*)?$", changelog, re.MULTILINE))
    if len(found) != 1:
        raise fail(f"{CHANGELOG} has {len(found)} headings {heading} instead of one.")
    following = re.compile(r"^## ", re.MULTILINE).search(changelog, found[0].end())
    return found[0].end(), following.start() if following else len(changelog)


def notes_of(changelog: str, heading: str) -> str:
    """The text of a section; empty if it has no entry."""
    start, end = section(changelog, heading)
    text = changelog[start:end].strip()
    return f"{text}\n" if re.search(r"^- ", text, re.MULTILINE) else ""


def released_versions(changelog: str) -> list[str]:
    return re.findall(rf"^## \[({VERSION})\] - \d{{4}}-\d\d-\d\d$", changelog, re.MULTILINE)


def with_release(changelog: str, version: str, date: str) -> str:
    """Moves the unreleased changes below a heading of this version, and adds the heading for the next
    ones above it."""
    start, _end = section(changelog, UNRELEASED)
    return f"{changelog[:start]}\n\n## [{version}] - {date}{changelog[start:]}"


# --- Obstacles


def git(root: Path, *words: str) -> str | None:
    """git's output, or None if it fails."""
    try:
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def obstacles_in_texts(texts: Texts, version: str) -> list[str]:
    found = []
    named, released = version_in(texts), released_versions(texts[CHANGELOG])
    if released and numbers(version) <= max(map(numbers, released)):
        newest = max(released, key=numbers)
        found.append(f"{version} is not newer than {newest}, which {CHANGELOG} has as released.")
    elif numbers(version) < numbers(named):
        found.append(f"{version} is older than {named}, which the files name.")
    if not notes_of(texts[CHANGELOG], UNRELEASED):
        found.append(f"{CHANGELOG} has nothing below {UNRELEASED}.")
    return found


def obstacles_in_checkout(root: Path, version: str) -> list[str]:
    state = git(root, "status", "--porcelain")
    if state is None:
        return ["this is no git checkout."]
    found = []
    branch = git(root, "symbolic-ref", "--short", "HEAD")
    if branch != "main":
        found.append(f"this is {f'the branch {branch}' if branch else 'no branch'}, not main.")
    if state:
        found.append("the checkout has changes: commit them, or take them back.")
    if git(root, "tag", "--list", f"v{version}"):
        found.append(f"the tag v{version} is there already.")
    if release_folder(root, version).exists():
        found.append(f"{release_folder(root, version).relative_to(root)} is there already: take it away.")
    return found


# --- The release


def release_folder(root: Path, version: str) -> Path:
    return root / "dist" / f"release-{version}"


def write_texts(root: Path, texts: Texts) -> None:
    for name, text in texts.items():
        (root / name).write_text(text, encoding="utf-8", newline="")


def build_packages(root: Path) -> list[Path]:
    """Builds the zips, and returns the paths that ./dev package prints."""
    done = subprocess.run([root / "dev", "package"], cwd=root, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise fail("./dev package failed; the files have their old text again.")
    return [root / line for line in done.stdout.splitlines() if line.endswith(".zip")]


def wheels_in(package: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(package) as archive:
        return {
            entry.removeprefix("wheels/"): archive.read(entry)
            for entry in archive.namelist()
            if re.fullmatch(r"wheels/[^/\\]+\.whl", entry)
        }


def write_release(folder: Path, packages: list[Path], notes: str) -> None:
    """Writes the zips, their bills of materials, their wheels, the notes, and SHA256SUMS for sha256sum
    --check."""
    unfinished = folder.with_name(f".{folder.name}.unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    try:
        unfinished.mkdir(parents=True)
        for package in packages:
            for name, data in wheels_in(package).items():
                (unfinished / name).write_bytes(data)
            # The bill of materials is that of tools/sbom.py.
            for path in (package, package.with_suffix(".cdx.json")):
                shutil.copyfile(path, unfinished / path.name)
        (unfinished / "NOTES.md").write_text(notes, encoding="utf-8", newline="")
        sums = [
            f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n"
            for path in sorted(unfinished.iterdir())
        ]
        (unfinished / "SHA256SUMS").write_text("".join(sums), encoding="utf-8", newline="")
        unfinished.rename(folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def prepare(root: Path, version: str, date: str) -> Path:
    """Makes the release's folder and returns it; after an error, everything is as before."""
    before = read_texts(root)
    obstacles = obstacles_in_checkout(root, version) + obstacles_in_texts(before, version)
    if obstacles:
        raise fail(" ".join(obstacles))
    try:
        write_texts(root, edited(before, version, date))
        write_release(
            release_folder(root, version), build_packages(root), notes_of(before[CHANGELOG], UNRELEASED)
        )
    except BaseException:
        # The checkout had no changes.
        git(root, "restore", *FILES)
        raise
    return release_folder(root, version)


def edited(texts: Texts, version: str, date: str) -> dict[str, str]:
    result = with_version(texts, version, date)
    result[CHANGELOG] = with_release(texts[CHANGELOG], version, date)
    return result


def next_version(named: str, step: str) -> str:
    """`named` with one of its numbers incremented, if `step` names one; otherwise `step` itself."""
    major, minor, patch = numbers(named)
    raised = {
        "major": f"{major + 1}.0.0",
        "minor": f"{major}.{minor + 1}.0",
        "patch": f"{major}.{minor}.{patch + 1}",
    }
    return raised.get(step, step)


def show(root: Path, version: str, date: str) -> None:
    texts = read_texts(root)
    after = edited(texts, version, date)
    for obstacle in obstacles_in_checkout(root, version) + obstacles_in_texts(texts, version):
        print(f"In the way: {obstacle}")
    for name in FILES:
        old, new = texts[name].splitlines(), after[name].splitlines()
        for line in new:
            if line not in old:
                print(f"{name}: {line}")
    print(f"Then ./dev package, and {release_folder(root, version).relative_to(root)} with zips, wheels,")
    print("NOTES.md and SHA256SUMS. Nothing was changed.")


def next_steps(folder: Path, version: str) -> str:
    return f"""{folder} has the release {version}. Nothing is public, committed or tagged. Next:
  1. RELEASING.md, "Before": what is tested by hand
  2. git commit --all --message "release: {version}"
  3. git tag --sign v{version} --message "Sinew {version}"
  4. git push origin main v{version}: the tag has .github/workflows/release.yml build and publish
To take it back before that: git restore . and rm -r {folder}"""


def main() -> None:
    parser = argparse.ArgumentParser(prog="./dev release", description=__doc__.splitlines()[0])
    parser.add_argument("version", help="such as 1.4.0; or major, minor, patch: the next one of these")
    chosen = parser.add_mutually_exclusive_group()
    chosen.add_argument("--dry-run", action="store_true", help="say what it would do, and what is in the way")
    chosen.add_argument("--notes", action="store_true", help="print the notes of the version that is here")
    options = parser.parse_args()

    texts = read_texts(ROOT)
    version = next_version(version_in(texts), options.version)
    numbers(version)
    date = datetime.datetime.now(datetime.UTC).date().isoformat()
    if options.notes:
        if version != version_in(texts):
            raise fail(f"this is {version_in(texts)}, not {version}.")
        print(notes_of(texts[CHANGELOG], f"## [{version}]"), end="")
    elif options.dry_run:
        show(ROOT, version, date)
    else:
        folder = prepare(ROOT, version, date)
        print(next_steps(folder.relative_to(ROOT), version))


if __name__ == "__main__":
    sys.stdout.reconfigure(encoding="utf-8")
    main()
