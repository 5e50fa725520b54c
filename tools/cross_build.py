#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension for another platform with zig: a zip with wheels for several Pythons.

The Python that runs this needs ziglang, pybind11, scikit-build-core and auditwheel. Prints the zip's path.
The module is one file that contains the library: two files, each with its own standard library,
could not throw exceptions to each other.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import hashlib
import importlib.metadata
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

from package import write_zip
from platforms import PLATFORMS, Platform

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "platforms"
# Only these headers; the whole folder also contains this machine's C library.
HEADERS = {"glm": "glm", "hwy": "hwy", "Eigen": "eigen3/Eigen"}
SYSTEM_HEADERS = [Path("/usr/include"), Path("/usr/local/include"), Path("/opt/homebrew/include")]
GOOGLETEST = Path("/usr/src/googletest")
TESTS = ("sinew_deform_tests", "sinew_tests", "sinew_quiet_tests")


def fail(message: str) -> None:
    raise SystemExit(f"cross_build: {message}")


@dataclass(frozen=True)
class Python:
    """A Python of this machine: its version, such as 3.11, and its headers."""

    executable: Path
    version: str
    include: Path


def python_of(executable: Path) -> Python:
    code = (
        "import sys, sysconfig; print(sysconfig.get_path('include')); print('%d.%d' % sys.version_info[:2])"
    )
    done = subprocess.run([executable, "-I", "-c", code], capture_output=True, text=True, check=True)
    include, version = done.stdout.splitlines()
    return Python(executable, version, Path(include))


# --- zig


def zig_program() -> Path:
    import ziglang

    return Path(ziglang.__file__).with_name("zig")


def compilers(platform: Platform) -> dict[str, str]:
    """CMake's variables for the tools. Each is a script, because CMake expects a program and zig needs an
    argument.

    The scripts contain zig's version, so that ccache compiles again with another version."""
    folder = BUILD / platform.name / "bin"
    folder.mkdir(parents=True, exist_ok=True)
    words = {
        "CMAKE_CXX_COMPILER": f"c++ -target {platform.zig}",
        "CMAKE_C_COMPILER": f"cc -target {platform.zig}",
        "CMAKE_AR": "ar",
        "CMAKE_RANLIB": "ranlib",
        "CMAKE_RC_COMPILER": "rc",
    }
    version = importlib.metadata.version("ziglang")
    paths = {}
    for name, word in words.items():
        path = folder / word.split()[0]
        text = f'#!/bin/sh\n# zig {version}\nexec "{zig_program()}" {word} "$@"\n'
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
            path.chmod(0o755)
        paths[name] = str(path)
    return paths


def environment() -> dict[str, str]:
    # zig stores what it builds of the C and C++ libraries in its own folder. ccache identifies compilers by
    # their content: by date it would not recognise a script that was written again.
    kept = {
        key: value for key, value in os.environ.items() if key not in ("CXX", "CC", "CXXFLAGS", "LDFLAGS")
    }
    return kept | {
        "ZIG_GLOBAL_CACHE_DIR": str(BUILD / "zig"),
        "SOURCE_DATE_EPOCH": "315532800",
        "CCACHE_COMPILERCHECK": "content",
    }


def run(words: list[str | Path], log: Path) -> None:
    with log.open("a") as out:
        done = subprocess.run(words, cwd=ROOT, stdout=out, stderr=out, env=environment(), check=False)
    if done.returncode:
        sys.stderr.write(log.read_text()[-4000:])
        fail(f"{words[0]} failed; the log is {log}.")


# --- Headers


def collect_headers() -> Path:
    target = BUILD / "headers"
    for name, place in HEADERS.items():
        found = next((folder / place for folder in SYSTEM_HEADERS if (folder / place).is_dir()), None)
        if found is None:
            fail(f"the headers of {name} are not here.")
        if not (target / name).exists():
            shutil.copytree(found, target / name)
    return target


def collect_python_headers(python: Python) -> Path:
    target = BUILD / f"python{python.version}"
    if not target.exists():
        unfinished = Path(tempfile.mkdtemp(dir=BUILD))
        shutil.copytree(python.include, unfinished, dirs_exist_ok=True)
        shutil.copy(ROOT / "native/cmake/python/pyconfig.h", unfinished / "pyconfig.h")
        unfinished.rename(target)
    shutil.copy(ROOT / "native/cmake/python/pyconfig.h", target / "pyconfig.h")
    return target


EXPORTED = re.compile(r"\bPyAPI_(FUNC|DATA)\(\s*([^()]|\([^()]*\))*\)\s*(?P<name>_{0,2}Py\w+)")


def exported_names(include: Path) -> dict[str, bool]:
    """The names that Python's headers declare of its library: name -> whether it is data."""
    names = {}
    for header in sorted([*include.glob("*.h"), *include.glob("cpython/*.h")]):
        for match in EXPORTED.finditer(header.read_text(encoding="utf-8")):
            names[match["name"]] = match[1] == "DATA"
    return names


def import_library(platform: Platform, python: Python, include: Path) -> Path:
    """What a module for Windows is linked with: the names in python3xx.dll."""
    dll = f"python{python.version.replace('.', '')}"
    lines = [f"LIBRARY {dll}.dll", "EXPORTS"]
    lines += [name + (" DATA" if is_data else "") for name, is_data in exported_names(include).items()]
    folder = BUILD / platform.name
    folder.mkdir(parents=True, exist_ok=True)
    definition, library = folder / f"{dll}.def", folder / f"lib{dll}.a"
    definition.write_text("\n".join(lines) + "\n")
    machine = {"AMD64": "i386:x86-64", "ARM64": "arm64"}[platform.processor]
    words: list[str | Path] = [zig_program(), "dlltool", "-m", machine, "-d", definition, "-l", library]
    run(words, folder / "build.log")
    return library


# --- The build


def configure(platform: Platform, log: Path, options: dict[str, str], name: str = "build") -> Path:
    build = BUILD / platform.name / name
    headers = str(collect_headers())
    defined = compilers(platform) | {
        "CMAKE_BUILD_TYPE": "Release",
        "CMAKE_SYSTEM_NAME": platform.system,
        "CMAKE_SYSTEM_PROCESSOR": platform.processor,
        # The same optimisation as for what CMake tries before the build, because zig builds its libraries for
        # each. Without debugging information, which zig adds by default: it takes a seventh of the time and
        # nine tenths of an object file.
        "CMAKE_C_FLAGS": "-O2 -g0",
        "CMAKE_CXX_FLAGS": f"-O2 -g0 -ffile-prefix-map={ROOT}=.",
        # No symbols, and for Windows no timestamp.
        "CMAKE_EXE_LINKER_FLAGS": "-s",
        "CMAKE_MODULE_LINKER_FLAGS": "-s",
        "CMAKE_STRIP": "true",
        "CMAKE_INSTALL_NAME_TOOL": "true",
        "CMAKE_INTERPROCEDURAL_OPTIMIZATION": "OFF",
        "CMAKE_SKIP_RPATH": "ON",
        "CMAKE_DISABLE_FIND_PACKAGE_glm": "ON",
        "CMAKE_DISABLE_FIND_PACKAGE_GTest": "ON",
        "CMAKE_DISABLE_FIND_PACKAGE_Eigen3": "ON",
        "FETCHCONTENT_FULLY_DISCONNECTED": "ON",
        "FETCHCONTENT_SOURCE_DIR_GLM": headers,
        "FETCHCONTENT_SOURCE_DIR_EIGEN": headers,
        "FETCHCONTENT_SOURCE_DIR_GOOGLETEST": str(GOOGLETEST),
        "HWY_INCLUDE_DIR": headers,
        "BUILD_GMOCK": "OFF",
        "INSTALL_GTEST": "OFF",
        "SINEW_STATIC": "ON",
        "SINEW_STANDARD_LIBRARY_WITHIN": "ON",
        **options,
    }
    words: list[str | Path] = ["cmake", "-G", "Ninja", "-S", ROOT, "-B", build]
    # Clears what the last run found for another Python. Otherwise pybind11 would see another program, and ask
    # it for the name of its modules, though it is of this machine.
    for names in ("Python_*", "_Python_*", "PYTHON_*", "PYBIND11_*"):
        words += ["-U", names]
    run(words + [f"-D{name}={value}" for name, value in defined.items()], log)
    return build


def jobs() -> str:
    return os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or str(os.cpu_count())


def build_tests(platform: Platform, quick: bool = False) -> list[Path]:
    """Returns the programs.

    quick  kernels for one instruction set, no test that takes long, and only the program that tests kernels
    """
    if not GOOGLETEST.is_dir():
        fail(f"the sources of googletest are not in {GOOGLETEST}.")
    log = start_log(platform)
    options = {"SINEW_BUILD_TESTS": "ON", "SINEW_BUILD_PYTHON": "OFF"}
    programs = TESTS[:1] if quick else TESTS
    if quick:
        build = configure(platform, log, options | {"SINEW_ONE_TARGET": "ON"}, "quick")
    else:
        build = configure(platform, log, options)
    run(["cmake", "--build", build, "--parallel", jobs(), "--target", *programs], log)
    suffix = ".exe" if platform.is_windows else ""
    return [build / "tests" / "native" / (name + suffix) for name in programs]


def build_module(platform: Platform, python: Python, log: Path) -> Path:
    import pybind11

    include = collect_python_headers(python)
    options = {
        "SKBUILD": "ON",
        "SINEW_BUILD_TESTS": "OFF",
        "SINEW_BUILD_PYTHON": "ON",
        "Python_EXECUTABLE": str(python.executable),
        "Python_INCLUDE_DIR": str(include),
        "PYTHON_MODULE_EXTENSION": platform.module_suffix(python.version),
        "PYTHON_MODULE_DEBUG_POSTFIX": "",
        "PYBIND11_FINDPYTHON": "ON",
        "pybind11_DIR": pybind11.get_cmake_dir(),
    }
    if platform.system == "Darwin":
        options["CMAKE_USER_MAKE_RULES_OVERRIDE_CXX"] = str(ROOT / "native/cmake/zig_macos.cmake")
    if platform.is_windows:
        options["Python_LIBRARY"] = str(import_library(platform, python, include))
    build = configure(platform, log, options)
    run(["cmake", "--build", build, "--parallel", jobs(), "--target", "_native"], log)
    return build / "native" / "bindings" / ("_native" + platform.module_suffix(python.version))


def start_log(platform: Platform) -> Path:
    log = BUILD / platform.name / "build.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_text("")
    return log


# --- Wheels


def metadata() -> dict[str, bytes]:
    """METADATA and licences, as scikit-build-core writes them: name in .dist-info -> bytes."""
    from scikit_build_core.build import prepare_metadata_for_build_wheel

    with tempfile.TemporaryDirectory() as place, contextlib.chdir(ROOT):
        with contextlib.redirect_stdout(io.StringIO()):
            name = prepare_metadata_for_build_wheel(place)
        files = {
            path.relative_to(Path(place, name)).as_posix(): path.read_bytes()
            for path in Path(place, name).rglob("*")
            if path.is_file()
        }
    return {name: data for name, data in files.items() if name not in ("WHEEL", "RECORD")}


def package_files() -> dict[str, bytes]:
    folder = ROOT / "native" / "python"
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in (folder / "sinew").rglob("*")
        if path.is_file() and (path.suffix in (".py", ".pyi") or path.name == "py.typed")
    }


def record_line(name: str, data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}"


def write_wheel(module: Path, tag: str, described: dict[str, bytes], out: Path) -> Path:
    """Writes the wheel. described: a result of metadata()."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    stem = f"sinew_skinning-{version}"
    info = f"{stem}.dist-info"
    files = package_files() | {f"sinew/{module.name}": module.read_bytes()}
    files |= {f"{info}/{name}": data for name, data in described.items()}
    built = f"Wheel-Version: 1.0\nGenerator: sinew\nRoot-Is-Purelib: false\nTag: {tag}\n\n"
    files[f"{info}/WHEEL"] = built.encode()
    lines = [record_line(name, files[name]) for name in sorted(files)] + [f"{info}/RECORD,,"]
    files[f"{info}/RECORD"] = ("\n".join(lines) + "\n").encode()
    wheel = out / f"{stem}-{tag}.whl"
    write_zip(wheel, files)
    return wheel


AUDITED = re.compile(
    r"(?:consistent\s+with\s+the\s+following\s+platform\s+tag|constrains\s+the\s+platform\s+tag\s+to)"
    r'[:\s]+"(?P<tag>\w+)"'
)


def audit(wheel: Path, platform: Platform) -> None:
    """Checks with auditwheel that it runs on the systems that its name claims."""
    done = subprocess.run(
        [sys.executable, "-m", "auditwheel", "show", wheel], capture_output=True, text=True, check=False
    )
    found = AUDITED.search(done.stdout)
    wanted = re.fullmatch(r"manylinux_2_(\d+)_(\w+)", platform.wheel)
    is_from = found and re.fullmatch(r"manylinux_2_(\d+)_(\w+)", found["tag"])
    if not is_from or is_from[2] != wanted[2] or int(is_from[1]) > int(wanted[1]):
        fail(f"auditwheel does not find {wheel.name} to be {platform.wheel}:\n{done.stdout}{done.stderr}")


def build_wheels(platform: Platform, pythons: list[Python], out: Path) -> list[Path]:
    log = start_log(platform)
    described = metadata()
    made = []
    for python in pythons:
        module = build_module(platform, python, log)
        wheel = write_wheel(module, platform.wheel_tag(python.version), described, out)
        if platform.is_linux:
            audit(wheel, platform)
        made.append(wheel)
    return made


def build_package(platform: Platform, pythons: list[Python], validator: Path) -> None:
    """Builds the wheels, and the extension's zip with them, which Blender's program checks."""
    out, tools = ROOT / "dist/platforms" / platform.name, ROOT / "tools"
    shutil.rmtree(out, ignore_errors=True)
    build_wheels(platform, pythons, out)
    words = [sys.executable, "-I", tools / "package.py", "--platform", platform.name]
    made = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
    words = [validator, tools / "split_package.py", made, "--repository", Path(made).parent]
    subprocess.run(words, check=True)
    subprocess.run([sys.executable, "-I", tools / "sbom.py", made], check=True, stdout=sys.stderr)
    print(made)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("platform", choices=(*PLATFORMS, "all"))
    parser.add_argument("--python", type=Path, action="append", help="a Python to make a wheel for")
    parser.add_argument("--validator", type=Path, required=True, help="a Python with bpy")
    options = parser.parse_args()
    failed = []
    for name in PLATFORMS if options.platform == "all" else [options.platform]:
        print(f"building the library for {name}", file=sys.stderr, flush=True)
        # A failure does not prevent the others from being built.
        try:
            build_package(PLATFORMS[name], [python_of(path) for path in options.python], options.validator)
        except (SystemExit, subprocess.CalledProcessError) as error:
            print(error, file=sys.stderr)
            failed.append(name)
    if failed:
        fail(f"not built: {', '.join(failed)}")


if __name__ == "__main__":
    main()
