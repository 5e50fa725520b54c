#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a Python for Windows, to be run by wine, from what the Python registry has, for tests.

python3xx.dll and the compiled part of the standard library come from a wheel of panda3d, which includes them
for the programs that it packs. The rest of the standard library is the same on all systems, and is copied
from this Python. python.exe is a program of one line. python3.dll, with which modules for any Python are
linked, such as psutil's, forwards its names. Packages are installed next to it, as wheels for Windows.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from cross_build import BUILD, compilers, environment, exported_names, import_library, python_of
from cross_build import collect_python_headers as collect_headers
from platforms import PLATFORMS

VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
FOLDER = BUILD / f"windows-python{VERSION}"
PACKAGES = FOLDER / "Lib/site-packages"
# Of pip, to get what Windows needs.
WHEELS = ["--quiet", "--only-binary=:all:", "--platform", "win_amd64", "--python-version", VERSION]
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


def unpack_compiled(folder: Path) -> None:
    """Unpacks python3xx.dll into the folder, and extension modules with the libraries that they load into
    its DLLs."""
    with tempfile.TemporaryDirectory() as place:
        pip("download", "--no-deps", *WHEELS, "--dest", place, SOURCE)
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


def make(folder: Path) -> None:
    unpack_compiled(folder)
    shutil.copytree(
        sysconfig.get_path("stdlib"), folder / "Lib", ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=False
    )
    (folder / "Lib/site-packages").mkdir()
    compile_program(folder)
    link_forwarder(folder)


def make_once(folder: Path, make: Callable[[Path], None]) -> None:
    """Has a folder filled that is missing; it gets its name once it is whole."""
    if not folder.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(dir=BUILD))
        make(unfinished)
        unfinished.rename(folder)


def python() -> Path:
    """The path of python.exe."""
    make_once(FOLDER, make)
    return FOLDER / "python.exe"


def install(*words: str | Path) -> None:
    """words: requirements, or wheels for Windows, and options of pip"""
    pip("install", "--upgrade", "--no-compile", "--target", PACKAGES, *WHEELS, *words)
