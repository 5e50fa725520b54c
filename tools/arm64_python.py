#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a Python for Linux on arm64, to be run by qemu, from Debian's packages, for tests.

The packages, of the release of this Debian, are unpacked into a folder; nothing is installed on the machine.
Python packages are installed next to it, as wheels for arm64. Prints the path of a script that runs it.
Needs Debian's own Python, since that has the same version.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from cross_build import BUILD
from windows_python import pip

QEMU = "qemu-aarch64-static"
PACKAGES = (
    *("python{0}-minimal", "libpython{0}-minimal", "libpython{0}-stdlib"),
    *(
        "libc6",
        "libgcc-s1",
        "libstdc++6",
        "libexpat1",
        "zlib1g",
        "libssl3",
        "libffi8",
        "libbz2-1.0",
        "liblzma5",
    ),
    *("libsqlite3-0", "libuuid1", "libcrypt1", "libncursesw6", "libtinfo6", "libreadline8"),
)
# An own configuration of apt, with its own architecture, lists and cache.
APT_CONFIG = """\
APT::Architecture "arm64";
APT::Architectures {{"arm64";}};
Dir::State "{0}";
Dir::State::Lists "{0}/lists";
Dir::State::status "{0}/status";
Dir::Cache "{0}/cache";
APT::Sandbox::User "root";
"""
# The script is Python's sys.executable, so programs that Python starts through that are run by qemu, too.
SCRIPT = """\
#!/bin/sh
export PYTHONHOME="{root}/usr"
exec {qemu} -0 "$0" -L "{root}" "{root}/usr/bin/python{version}" "$@"
"""


def apt_get(folder: Path, *words: str) -> None:
    config = folder / "apt.conf"
    for name in ("lists/partial", "cache/archives/partial", "debs"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "status").touch()
    config.write_text(APT_CONFIG.format(folder))
    done = subprocess.run(
        ["apt-get", "-qq", *words],
        cwd=folder / "debs",
        env=os.environ | {"APT_CONFIG": str(config)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise SystemExit(f"arm64_python: apt-get {words[0]} failed:\n{done.stderr}")


def make(version: str, root: Path) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        apt_get(folder, "update")
        apt_get(folder, "download", *(name.format(version) for name in PACKAGES))
        for package in sorted((folder / "debs").glob("*.deb")):
            subprocess.run(["dpkg-deb", "--extract", package, root], check=True)
    (root / "usr/lib/python3/dist-packages").mkdir(parents=True, exist_ok=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("packages", nargs="*", help="requirements, or wheels for Linux on arm64")
    parser.add_argument("--no-deps", action="store_true", help="these packages alone")
    options = parser.parse_args()
    if not shutil.which(QEMU):
        raise SystemExit(f"arm64_python: {QEMU} is not here.")
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    root = BUILD / f"arm64-python{version}"
    if not root.exists():
        unfinished = Path(tempfile.mkdtemp(dir=BUILD))
        make(version, unfinished)
        unfinished.rename(root)
    script = root / "python"
    script.write_text(SCRIPT.format(root=root, qemu=QEMU, version=version))
    script.chmod(0o755)
    if options.packages:
        systems = [f"--platform=manylinux_2_{minor}_aarch64" for minor in (28, 27, 17)]
        systems += ["--platform=manylinux2014_aarch64", "--python-version", version]
        target = root / "usr/lib/python3/dist-packages"
        words = ["--upgrade", "--no-compile", "--quiet", "--only-binary=:all:", *systems]
        words += ["--no-deps"] if options.no_deps else []
        pip("install", "--target", target, *words, *options.packages)
    print(script)


if __name__ == "__main__":
    main()
