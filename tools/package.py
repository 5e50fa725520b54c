#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the extension and the library's wheels into dist/sinew-VERSION.zip, and prints its path.

Includes the wheels that are given, or all of this version in dist/wheels/; or only those of one platform,
built by tools/cross_build.py, into dist/platforms/sinew-VERSION-PLATFORM.zip, with Blender's name of the
platform. The zip's manifest lists them (`wheels`) and their systems (`platforms`). The same files always
give the same bytes.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ADDON = ROOT / "addon"
NOT_SHIPPED = re.compile(
    r"pyproject\.toml|(setup|dask_cluster)\.py|sinew_reskin\.js|__pycache__|build|dist|\..*|"
    r".*\.(pyc|egg-info|blend\d+|orig|rej)"
)
WHEEL_NAME = re.compile(r"[^-]+-(?P<version>[^-]+)(-\d[^-]*)?-(?P<python>[^-]+)-[^-]+-(?P<system>[^-]+)\.whl")
PLATFORMS = {
    r"(manylinux.*|linux)_x86_64": ["linux-x64"],
    r"(manylinux.*|linux)_aarch64": ["linux-arm64"],
    r"macosx_.*_arm64": ["macos-arm64"],
    r"macosx_.*_x86_64": ["macos-x64"],
    r"macosx_.*_universal2": ["macos-arm64", "macos-x64"],
    r"win_amd64": ["windows-x64"],
    r"win_arm64": ["windows-arm64"],
}
ALL_PLATFORMS = {name for names in PLATFORMS.values() for name in names}
# The earliest date that a zip can store.
EPOCH = (1980, 1, 1, 0, 0, 0)


class Wheel:
    def __init__(self, path: Path) -> None:
        fields = WHEEL_NAME.fullmatch(path.name)
        if fields is None:
            raise SystemExit(f"package: {path.name} is not a wheel's name")
        self.path = path
        self.version, self.python = fields["version"], fields["python"]
        # A wheel may have several tags of one system, such as manylinux_2_17_x86_64.manylinux2014_x86_64.
        self.tags = fields["system"].split(".")

    @property
    def platforms(self) -> list[str]:
        found: set[str] = set()
        for tag in self.tags:
            for pattern, names in PLATFORMS.items():
                if re.fullmatch(pattern, tag):
                    found.update(names)
        if not found:
            raise SystemExit(f"package: Blender has no platform for {self.path.name}")
        return sorted(found)

    @property
    def is_portable(self) -> bool:
        return not any(tag.startswith("linux_") for tag in self.tags)


def select_wheels(paths: list[Path], version: str) -> list[Wheel]:
    """Those of this version; of two for the same, the one that runs on more systems."""
    chosen: dict[tuple[str, tuple[str, ...]], Wheel] = {}
    for wheel in map(Wheel, sorted(paths)):
        key = (wheel.python, tuple(wheel.platforms))
        if wheel.version == version and (key not in chosen or wheel.is_portable):
            chosen[key] = wheel
    if not chosen:
        raise SystemExit(f"package: there is no wheel of version {version}")
    return [chosen[key] for key in sorted(chosen)]


def warn_of_gaps(wheels: list[Wheel]) -> None:
    """Warns if a platform lacks a wheel for some Python, since Blender installs a zip on each of its
    platforms."""
    pythons = {wheel.python for wheel in wheels}
    for platform in sorted({p for wheel in wheels for p in wheel.platforms}):
        missing = pythons - {wheel.python for wheel in wheels if platform in wheel.platforms}
        if missing:
            print(f"package: no wheel on {platform} for {', '.join(sorted(missing))}", file=sys.stderr)


def manifest_with_wheels(text: str, wheels: list[Wheel]) -> str:
    before = tomllib.loads(text)
    for key in ("wheels", "platforms"):
        if key in before:
            raise SystemExit(f"package: addon/blender_manifest.toml must leave {key} to packaging")
    platforms = sorted({p for wheel in wheels for p in wheel.platforms})
    added = "platforms = [" + ", ".join(f'"{p}"' for p in platforms) + "]\nwheels = [\n"
    added += "".join(f'    "./wheels/{wheel.path.name}",\n' for wheel in wheels) + "]\n"
    # A key after a table's heading would belong to that table.
    table = re.search(r"^\[", text, re.MULTILINE)
    at = table.start() if table else len(text)
    result = text[:at] + added + ("\n" if table else "") + text[at:]
    after = tomllib.loads(result)
    listed = [f"./wheels/{wheel.path.name}" for wheel in wheels]
    if after != before | {"wheels": listed, "platforms": platforms}:
        raise SystemExit("package: addon/blender_manifest.toml is not written as this tool expects")
    return result


def shipped_files(folder: Path) -> list[Path]:
    found: list[Path] = []
    for entry in sorted(folder.iterdir()):
        if NOT_SHIPPED.fullmatch(entry.name):
            continue
        found += shipped_files(entry) if entry.is_dir() else [entry]
    return found


def write_zip(target: Path, files: dict[str, bytes]) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with zipfile.ZipFile(unfinished, "w") as archive:
            for name in sorted(files):
                entry = zipfile.ZipInfo(name, EPOCH)
                entry.create_system = 3
                entry.external_attr = 0o100644 << 16
                # Wheels are compressed already.
                entry.compress_type = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
                archive.writestr(entry, files[name])
        os.replace(unfinished, target)
    finally:
        unfinished.unlink(missing_ok=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheels", type=Path, nargs="*", help="these in place of all in the folder")
    parser.add_argument("--platform", choices=sorted(ALL_PLATFORMS), help="the only one that the zip is for")
    options = parser.parse_args()

    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    manifest = (ADDON / "blender_manifest.toml").read_text()
    if tomllib.loads(manifest)["version"] != version:
        raise SystemExit(f"package: addon/blender_manifest.toml is not of pyproject.toml's version {version}")

    folder, name = ROOT / "dist/wheels", f"sinew-{version}.zip"
    if options.platform:
        folder = ROOT / "dist/platforms" / options.platform
        name = f"platforms/sinew-{version}-{options.platform.replace('-', '_')}.zip"
    wheels = select_wheels(options.wheels or [*folder.glob("*.whl")], version)
    if options.platform and any(wheel.platforms != [options.platform] for wheel in wheels):
        raise SystemExit(f"package: {folder.relative_to(ROOT)}/ holds a wheel for another platform")
    warn_of_gaps(wheels)
    files = {path.relative_to(ADDON).as_posix(): path.read_bytes() for path in shipped_files(ADDON)}
    files["blender_manifest.toml"] = manifest_with_wheels(manifest, wheels).encode()
    for notice in ("LICENSE", "NOTICES.md"):
        files[notice] = (ROOT / notice).read_bytes()
    files |= {f"wheels/{wheel.path.name}": wheel.path.read_bytes() for wheel in wheels}
    target = ROOT / "dist" / name
    write_zip(target, files)
    print(target.relative_to(ROOT).as_posix())


if __name__ == "__main__":
    main()
