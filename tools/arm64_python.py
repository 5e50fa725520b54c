#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a Python for Linux on arm64, to be run by qemu, from Debian's packages, for tests.

The packages, of the release of this Debian, are unpacked into a folder; nothing is installed on the machine.
Python packages are installed next to it, as wheels for arm64. A script runs it.
Needs Debian's own Python, since that has the same version.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from cross_build import BUILD
from windows_python import VERSION, make_once, pip

ROOT = BUILD / f"arm64-python{VERSION}"
PACKAGES = ROOT / "usr/lib/python3/dist-packages"
QEMU = "qemu-aarch64-static"
OF_DEBIAN = """
python{0}-minimal libpython{0}-minimal libpython{0}-stdlib libc6 libgcc-s1 libstdc++6 libexpat1 zlib1g libssl3
libffi8 libbz2-1.0 liblzma5 libsqlite3-0 libuuid1 libcrypt1 libncursesw6 libtinfo6 libreadline8
"""
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


def make(root: Path) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        apt_get(folder, "update")
        apt_get(folder, "download", *OF_DEBIAN.format(VERSION).split())
        for package in sorted((folder / "debs").glob("*.deb")):
            subprocess.run(["dpkg-deb", "--extract", package, root], check=True)
    (root / "usr/lib/python3/dist-packages").mkdir(parents=True, exist_ok=True)


def python() -> Path:
    """The path of the script."""
    if not shutil.which(QEMU):
        raise SystemExit(f"arm64_python: {QEMU} is not here.")
    make_once(ROOT, make)
    script = ROOT / "python"
    script.write_text(SCRIPT.format(root=ROOT, qemu=QEMU, version=VERSION))
    script.chmod(0o755)
    return script


def install(*words: str | Path) -> None:
    """words: requirements, or wheels for Linux on arm64, and options of pip"""
    systems = [f"--platform=manylinux_2_{minor}_aarch64" for minor in (28, 27, 17)]
    systems += ["--platform=manylinux2014_aarch64", "--python-version", VERSION]
    options = ["--upgrade", "--no-compile", "--quiet", "--only-binary=:all:", *systems]
    pip("install", "--target", PACKAGES, *options, *words)
