#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs tests of what tools/cross_build.py builds: for linux-x64, linux-arm64 (qemu) and windows-x64 (wine).

Runs the C++ tests; for the two emulated platforms also the Python tests, in a Python of that platform; for
Windows also some of the Blender tests, in Blender's own build of bpy. The Python that runs this needs the
same packages as for tools/cross_build.py; missing wheels are fetched from the registry.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import arm64_python
import windows_python
from cross_build import BUILD, ROOT, build_tests, build_wheels, python_of
from platforms import PARTS, PLATFORMS, Platform, note_as_tested

# The prefix of a C++ program's command. The C library for arm64 is Debian's package for cross-compilation
# (libc6-arm64-cross).
NATIVE: dict[str, list[str | Path]] = {
    "linux-x64": [],
    "linux-arm64": ["qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu"],
    "windows-x64": ["wine"],
}
# Shapes compared with Blender's, Sinew added and removed, files saved and read, bakes, commands, batches
# with kills.
BLENDER_TESTS = (
    *("deform/test_against_armature_modifier", "deform/test_editing", "commands/test_restore"),
    *("attach/test_saved_files", "features/bake/test_bake", "commands/test_command_line", "jobs/test_batch"),
)
# Single tests that do not run there, each with the reason.
LEFT_OUT: dict[str, dict[str, str]] = {
    "linux-arm64": {},
    "windows-x64": {
        "tests/blender/jobs/test_batch.py::test_200_files_on_one_machine_and_on_a_cluster": (
            "it makes a folder that nobody may write in, as Linux knows them"
        ),
        "tests/blender/jobs/test_batch.py::test_killed_at_random[cluster]": "dask by wine has not been tried",
    },
}
BPY = "bpy==4.5.*"
# The version that Blender 4.5 includes, which its compiled code requires.
NUMPY = "numpy==1.26.*"
# Seconds for a program: a multiple of the time that it takes on a machine with two processors.
LIMITS = {"native": 3600, "python": 5400, "blender": 2400}


def environment() -> dict[str, str]:
    kept = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))
    }
    # Switches wine's own messages off, and sets a folder for its files.
    return kept | {"WINEPREFIX": str(BUILD / "wine"), "WINEDEBUG": "-all", "SINEW_RIGS": ""}


def run(words: Sequence[str | Path], limit: int) -> int:
    """Runs a program and prints its output. Returns its exit code, or 124, as timeout(1) does, if it does
    not end in time. Programs under wine fail if standard output is a file, so they get a pipe."""
    process = subprocess.Popen(
        words,
        cwd=ROOT,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    late = threading.Event()

    def end() -> None:
        late.set()
        os.killpg(process.pid, signal.SIGKILL)

    timer = threading.Timer(limit, end)
    timer.start()
    try:
        for line in process.stdout or ():
            sys.stdout.buffer.write(line)
            sys.stdout.flush()
        status = process.wait()
    finally:
        timer.cancel()
    if late.is_set():
        print(f"no end after {limit} s")
        return 124
    return status


def requirements() -> list[str]:
    """The requirements of the extension and of its tests, without Sinew and Blender."""
    lines = (ROOT / "requirements/tests.in").read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


class Emulated:
    """The Python of a platform. `maker` makes it and installs packages."""

    def __init__(self, platform: Platform) -> None:
        self.platform = platform
        self.maker = windows_python if platform.is_windows else arm64_python

    @cached_property
    def python(self) -> Path:
        return self.maker.python()

    def set_up_python(self) -> None:
        (wheel,) = build_wheels(
            self.platform, [python_of(Path(sys.executable))], ROOT / "dist/platforms/tested"
        )
        wanted = [*requirements(), *([NUMPY] if self.platform.is_windows else [])]
        stamp = self.python.parent / "requirements"
        if not stamp.exists() or stamp.read_text() != " ".join(wanted):
            self.maker.install(*wanted)
            stamp.write_text(" ".join(wanted))
        self.maker.install("--no-deps", wheel)
        link = self.maker.PACKAGES / "sinew_addon"
        if not link.is_symlink():
            link.symlink_to(ROOT / "addon", target_is_directory=True)

    def pytest(self, limit: int, *options: str) -> int:
        words: list[str | Path] = ["wine"] if self.platform.is_windows else []
        words += [self.python, "-X", "faulthandler", "-m", "pytest", "-q", "-p", "no:cacheprovider", *options]
        for test, reason in LEFT_OUT[self.platform.name].items():
            print(f"left out: {test}: {reason}")
            words.append(f"--deselect={test}")
        return run(words, limit)


def native_tests(platform: Platform, quick: bool) -> int:
    worst = 0
    for program in build_tests(platform, quick):
        start = time.monotonic()
        status = run([*NATIVE[platform.name], program, "--gtest_brief=1"], LIMITS["native"])
        print(f"{program.name}: exit {status}, {time.monotonic() - start:.0f} s", flush=True)
        worst = worst or status
    return worst


def python_tests(emulated: Emulated, options: Sequence[str]) -> int:
    emulated.set_up_python()
    return emulated.pytest(LIMITS["python"], *(options or ["tests/python"]))


def blender_tests(emulated: Emulated, options: Sequence[str]) -> int:
    emulated.set_up_python()
    if not (emulated.maker.PACKAGES / "bpy").is_dir():
        emulated.maker.install(BPY)
    if options:
        return emulated.pytest(LIMITS["blender"], *options)
    # Each in its own process, so that one can not affect the others.
    worst = 0
    for name in BLENDER_TESTS:
        print(f"-- {name}", flush=True)
        worst = emulated.pytest(LIMITS["blender"], f"tests/blender/{name}.py") or worst
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0],
        epilog="What stands behind -- goes to pytest, in place of all tests of a part.",
    )
    parser.add_argument("platform", choices=PARTS)
    parser.add_argument("--part", choices=("native", "python", "blender"), action="append", help="only this")
    parser.add_argument(
        "--quick", action="store_true", help="C++ tests of kernels for one instruction set, and no long ones"
    )
    # Not as arguments: behind an option, argparse takes no others but the first.
    end = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    options, for_pytest = parser.parse_args(sys.argv[1:end]), sys.argv[end + 1 :]
    platform = PLATFORMS[options.platform]
    parts = options.part or PARTS[options.platform]
    if missing := set(parts) - set(PARTS[options.platform]):
        parser.error(f"{options.platform} has no part {missing.pop()}.")
    emulated = Emulated(platform)
    results = {}
    for part in parts:
        print(f"\n== {options.platform}: {part} ==", flush=True)
        if part == "native":
            results[part] = native_tests(platform, options.quick)
        else:
            tests = python_tests if part == "python" else blender_tests
            results[part] = tests(emulated, for_pytest)
    print("\n== Summary ==")
    for part, status in results.items():
        print(f"  {options.platform} {part:8} {'passed' if status == 0 else f'FAILED ({status})'}")
    if any(results.values()):
        sys.exit(1)
    if not (options.part or options.quick or for_pytest):
        note_as_tested(options.platform)


if __name__ == "__main__":
    main()
