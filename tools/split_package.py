#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits the extension's zip into one for each platform, validates them, and makes their folder a repository
that Blender can install from: index.json, and index.html as its page. All with Blender's own program.

Without a folder for these, validates zips as they are.

The Python that runs this needs bpy, as .venv has it, which contains Blender's program for extensions.
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from package import write_zip


def blenders_program() -> Path:
    """The program that `blender --command extension` runs, which does not need bpy."""
    spec = importlib.util.find_spec("bpy")
    found = [
        path
        for folder in (spec.submodule_search_locations or [] if spec else [])
        for path in Path(folder).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    ]
    if len(found) != 1:
        raise SystemExit("split: this Python has no bpy with Blender's program for extensions.")
    return found[0]


def run(*words: str | Path) -> None:
    done = subprocess.run(
        [sys.executable, blenders_program(), *words],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise SystemExit(f"split: Blender refuses {words[-1]}:\n{done.stdout}{done.stderr}".rstrip())


def files_in(package: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(package) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def split(package: Path, out: Path) -> list[Path]:
    """Makes a zip in `out` for each platform in the package's manifest, with its wheels, and returns
    their paths."""
    with tempfile.TemporaryDirectory() as place:
        sources, made = Path(place, "sources"), Path(place, "made")
        made.mkdir()
        with zipfile.ZipFile(package) as archive:
            archive.extractall(sources)
        run("build", "--split-platforms", "--output-dir", made, "--source-dir", sources)
        # Blender dates the files that it writes itself; the same files must give the same bytes.
        split_files = {path: files_in(path) for path in sorted(made.glob("*.zip"))}
        for path, files in split_files.items():
            write_zip(path, files)
            run("validate", path)
        for path, files in split_files.items():
            write_zip(out / path.name, files)
    return [out / path.name for path in split_files]


def make_repository(folder: Path) -> None:
    """Lists the zips of a folder, which may then be served as it is. Links are relative."""
    page = Path(__file__).with_name("repository.html")
    run("server-generate", "--html", "--html-template", page, "--repo-dir", folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "packages", type=Path, nargs="+", metavar="package", help="a zip that ./dev package made"
    )
    parser.add_argument("--out", type=Path, help="folder for the zips, as a repository")
    parser.add_argument("--repository", type=Path, help="make the folder that has the packages a repository")
    options = parser.parse_args()
    for package in options.packages:
        run("validate", package)
        for path in split(package, options.out) if options.out else []:
            print(path)
    if folder := options.out or options.repository:
        make_repository(folder)


if __name__ == "__main__":
    main()
