# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks style, types, licences and workflows, as `./dev lint` does.

python tools/lint.py FOLDER-OF-PROGRAMS [--fast]
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from without_blender import all_files, runs_without_blender

ROOT = Path(__file__).resolve().parents[1]


def fails(line: str, *others: object, **options: object) -> bool:
    done = subprocess.run([*line.split(), *map(str, others)], cwd=ROOT, check=False, **options)
    return done.returncode != 0


def typed_files() -> set[Path]:
    """Returns what mypy reads: the files of pyproject.toml, and all of addon/ that run without Blender."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    listed = {path for pattern in settings["files"] for path in ROOT.glob(pattern)}
    others = [path for path in all_files() if listed.isdisjoint((path, *path.parents))]
    return listed | {path for path in others if runs_without_blender(path)}


def main(programs: str, *words: str) -> int:
    folders = ("native", "tests/native", "bench", "experiments")
    cpp = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.suffix in (".h", ".cpp")]
    lines = ["ruff check .", "ruff format --check .", "reuse lint --lines"]
    lines += ["check-jsonschema --quiet --builtin-schema vendor.dependabot .github/dependabot.yml"]
    lines += ["zizmor --quiet --offline --no-progress --min-severity medium .github"]
    failed = [fails(f"{programs}/{line}") for line in lines]
    failed.append(fails(f"{programs}/mypy --no-error-summary", *typed_files()))
    workflows = f"{programs}/check-jsonschema --quiet --builtin-schema vendor.github-workflows"
    failed.append(fails(workflows, *(ROOT / ".github/workflows").glob("*.yml")))
    failed.append(fails(f"{programs}/clang-format --dry-run -Werror", *cpp))
    if "--fast" not in words:
        # The library as it is compiled; native/.clang-tidy lists the checks.
        line = "cmake --preset release -B build/tidy -DSINEW_BUILD_TESTS=OFF -DSINEW_ONE_TARGET=ON"
        failed.append(fails(line, stdout=subprocess.DEVNULL))
        line = f"{programs}/run-clang-tidy.py -quiet -hide-progress -config-file native/.clang-tidy"
        failed.append(fails(f"{line} -p build/tidy -clang-tidy-binary {programs}/clang-tidy native/sinew"))
    # No registry that ./dev installs from has actionlint.
    if shutil.which("actionlint"):
        failed.append(fails("actionlint"))
    return int(any(failed))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
