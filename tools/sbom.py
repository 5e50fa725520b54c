#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the bill of materials of the extension's zips next to them: NAME.cdx.json, in CycloneDX 1.6.

It lists the actual content of a zip: the extension, each wheel in it with its digest, and the other projects
compiled into the wheel's module, with versions and licences. The module itself contains this list
(native/bindings/compiled_in.cpp), so it is right for wheels that were built elsewhere, too. The same zip
always gives the same bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import re
import sys
import tomllib
import uuid
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

COMPILED_IN = re.compile(rb"sinew-compiled-in\{([^{}\0]+)\}")
MODULE = re.compile(r"sinew/_native\.[^/]*(so|pyd)")

Component = dict[str, Any]


@dataclass(frozen=True)
class Project:
    """A project whose code is compiled in.

    licence  an SPDX expression
    purl     in the form of package-url.org, without the version
    source   the address of its code
    """

    licence: str
    purl: str
    source: str


# NOTICES.md has the full licences.
PROJECTS = {
    "GLM": Project("MIT", "pkg:github/g-truc/glm", "https://github.com/g-truc/glm"),
    "Highway": Project("Apache-2.0", "pkg:github/google/highway", "https://github.com/google/highway"),
    "Eigen": Project("MPL-2.0", "pkg:generic/eigen", "https://gitlab.com/libeigen/eigen"),
    "pybind11": Project("BSD-3-Clause", "pkg:pypi/pybind11", "https://github.com/pybind/pybind11"),
    "LLVM": Project(
        "Apache-2.0 WITH LLVM-exception",
        "pkg:github/llvm/llvm-project",
        "https://github.com/llvm/llvm-project",
    ),
    "mingw-w64": Project("ZPL-2.1", "pkg:generic/mingw-w64", "https://www.mingw-w64.org"),
}


def fail(message: str) -> SystemExit:
    return SystemExit(f"sbom: {message}")


def version_of(name: str, said: str) -> str:
    """The usual form of a version, from what a project's headers say."""
    if name == "LLVM" and re.fullmatch(r"\d{5,}", said):
        number = int(said)
        return f"{number // 10000}.{number // 100 % 100}.{number % 100}"
    found = re.search(r"\d+(\.\d+)+", said)
    if found is None:
        raise fail(f"{name} says no version but {said!r}.")
    return found[0]


def compiled_in(module: bytes) -> list[tuple[str, str]]:
    """The projects that a module says are compiled into it: name and version of each."""
    # A universal module for macOS has a part for each processor, all with the same list.
    said = {match[1] for match in COMPILED_IN.finditer(module)}
    if len(said) != 1:
        raise fail(f"a module says {len(said)} times what is compiled into it; build it anew.")
    pairs = [entry.split("=", 1) for entry in said.pop().decode().split(";")]
    unknown = [name for name, _version in pairs if name not in PROJECTS]
    if unknown:
        raise fail(f"{', '.join(unknown)}: the licence is not known here; add it to PROJECTS and NOTICES.md.")
    return [(name, version_of(name, said)) for name, said in pairs]


def digest(data: bytes) -> list[dict[str, str]]:
    return [{"alg": "SHA-256", "content": hashlib.sha256(data).hexdigest()}]


def licensed(expression: str) -> list[dict[str, str]]:
    return [{"expression": expression}]


def project_component(name: str, version: str, wheel: str) -> Component:
    project = PROJECTS[name]
    return {
        "type": "library",
        "bom-ref": f"{wheel}#{name}",
        "name": name,
        "version": version,
        "licenses": licensed(project.licence),
        "purl": f"{project.purl}@{version}",
        "externalReferences": [{"type": "vcs", "url": project.source}],
    }


def wheel_component(name: str, data: bytes) -> Component:
    with zipfile.ZipFile(io.BytesIO(data)) as wheel:
        modules = [wheel.read(entry) for entry in wheel.namelist() if MODULE.fullmatch(entry)]
        described = next(entry for entry in wheel.namelist() if entry.endswith(".dist-info/METADATA"))
        fields = dict(re.findall(r"^(Name|Version): (.+)$", wheel.read(described).decode(), re.MULTILINE))
    if len(modules) != 1:
        raise fail(f"{name} holds {len(modules)} modules _native instead of one.")
    distribution, version = fields["Name"], fields["Version"]
    return {
        "type": "library",
        "bom-ref": name,
        "name": distribution,
        "version": version,
        "description": name,
        "hashes": digest(data),
        "licenses": licensed("GPL-3.0-or-later"),
        "purl": f"pkg:pypi/{distribution}@{version}?file_name={name}",
        "components": [project_component(*pair, name) for pair in compiled_in(modules[0])],
    }


def bill_of(package: Path) -> dict[str, Any]:
    data = package.read_bytes()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        names = [name.removeprefix("./") for name in manifest["wheels"]]
        wheels = [wheel_component(Path(name).name, archive.read(name)) for name in names]
        held = {entry for entry in archive.namelist() if entry.startswith("wheels/")}
    if held != set(names):
        raise fail(f"{package.name} holds other wheels than its manifest names.")
    (licence,) = manifest["license"]
    ours = {
        "type": "application",
        "bom-ref": package.name,
        "name": manifest["id"],
        "version": manifest["version"],
        "description": manifest["tagline"],
        "hashes": digest(data),
        "licenses": licensed(licence.removeprefix("SPDX:")),
    }
    depends = [{"ref": package.name, "dependsOn": [wheel["bom-ref"] for wheel in wheels]}]
    depends += [
        {"ref": wheel["bom-ref"], "dependsOn": [part["bom-ref"] for part in wheel["components"]]}
        for wheel in wheels
    ]
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        # Derived from the zip's bytes: the same zip has the same number, another zip another one.
        "serialNumber": uuid.uuid5(uuid.NAMESPACE_URL, hashlib.sha256(data).hexdigest()).urn,
        "version": 1,
        "metadata": {"component": ours},
        "components": wheels,
        "dependencies": depends,
    }


def write_bill(package: Path) -> Path:
    path = package.with_suffix(".cdx.json")
    text = json.dumps(bill_of(package), indent=2, ensure_ascii=False) + "\n"
    path.write_text(text, encoding="utf-8", newline="")
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "packages", type=Path, nargs="+", metavar="package", help="a zip that ./dev package made"
    )
    for package in parser.parse_args().packages:
        print(write_bill(package))


if __name__ == "__main__":
    sys.stdout.reconfigure(encoding="utf-8")  # type: ignore[union-attr]
    main()
