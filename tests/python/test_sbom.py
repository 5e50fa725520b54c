# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the bill of materials of a zip: compared with the module itself, and with
CycloneDX's schema."""

from __future__ import annotations

import hashlib
import json
import re
import sys
import zipfile
from pathlib import Path

import pytest
import sinew._native

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import cross_build  # noqa: E402
import package  # noqa: E402
import sbom  # noqa: E402
from platforms import PLATFORMS  # noqa: E402

MODULE = Path(sinew._native.__file__)
METADATA = b"Metadata-Version: 2.1\nName: sinew-skinning\nVersion: 1.2.3\n\nText\n"


def make_wheel(folder: Path, module: bytes, version: str = "3.11") -> Path:
    path = folder / f"_native.{version}.so"
    folder.mkdir(parents=True, exist_ok=True)
    path.write_bytes(module)
    tag = PLATFORMS["linux-x64"].wheel_tag(version)
    return cross_build.write_wheel(path, tag, {"METADATA": METADATA}, folder)


def make_zip(path: Path, wheels: list[Path]) -> Path:
    manifest = (ROOT / "addon/blender_manifest.toml").read_text(encoding="utf-8")
    files = {f"wheels/{wheel.name}": wheel.read_bytes() for wheel in wheels}
    text = package.manifest_with_wheels(manifest, [package.Wheel(wheel) for wheel in wheels])
    package.write_zip(path, files | {"blender_manifest.toml": text.encode()})
    return path


@pytest.fixture
def zip_of_two(tmp_path):
    """A zip with this Python's module for one Python, and a module with other contents for another."""
    other = b"\0sinew-compiled-in{GLM=GLM: version 1.0.1;LLVM=220108;mingw-w64=13.0.0}\0"
    wheels = [make_wheel(tmp_path, MODULE.read_bytes()), make_wheel(tmp_path, other, "3.13")]
    return make_zip(tmp_path / "sinew-1.2.3.zip", wheels)


def test_it_lists_the_contents_of_the_zip(zip_of_two):
    bill = json.loads(sbom.write_bill(zip_of_two).read_text(encoding="utf-8"))
    ours = bill["metadata"]["component"]
    assert ours["name"] == "sinew"
    assert ours["hashes"][0]["content"] == hashlib.sha256(zip_of_two.read_bytes()).hexdigest()
    with zipfile.ZipFile(zip_of_two) as archive:
        held = {
            name.removeprefix("wheels/"): hashlib.sha256(archive.read(name)).hexdigest()
            for name in archive.namelist()
            if name.startswith("wheels/")
        }
    assert {part["bom-ref"]: part["hashes"][0]["content"] for part in bill["components"]} == held
    first, second = bill["components"]
    # This module was compiled with the headers that it names.
    said = dict(part.split("=") for part in re.findall(r"\w+=[^;}]+", sinew._native.__compiled_in__))
    assert {part["name"]: part["version"] for part in first["components"]} == {
        name: version.removeprefix("GLM: version ") for name, version in said.items()
    }
    assert {"GLM", "Highway", "pybind11"} <= set(said)
    assert {part["name"]: part["version"] for part in second["components"]} == {
        "GLM": "1.0.1",
        "LLVM": "22.1.8",
        "mingw-w64": "13.0.0",
    }


def test_it_is_valid_cyclonedx(zip_of_two):
    cyclonedx = pytest.importorskip(
        "cyclonedx.validation.json", reason="the library with the schema is not here"
    )
    from cyclonedx.schema import SchemaVersion

    validator = cyclonedx.JsonStrictValidator(SchemaVersion.V1_6)
    text = sbom.write_bill(zip_of_two).read_text(encoding="utf-8")
    assert validator.validate_str(text) is None
    assert validator.validate_str(text.replace('"library"', '"book"')) is not None


@pytest.mark.parametrize(
    ("module", "said"),
    [
        (b"nothing", "says 0 times what is compiled into it"),
        (b"sinew-compiled-in{GLM=1.2}sinew-compiled-in{GLM=1.3}", "says 2 times"),
        (b"sinew-compiled-in{Boost=1.2}", "Boost: the licence is not known here"),
        (b"sinew-compiled-in{GLM=none}", "GLM says no version"),
    ],
)
def test_modules_with_an_unclear_list_are_refused(module, said, tmp_path):
    package_path = make_zip(tmp_path / "sinew-1.2.3.zip", [make_wheel(tmp_path, module)])
    with pytest.raises(SystemExit, match=said):
        sbom.write_bill(package_path)
    assert not package_path.with_suffix(".cdx.json").exists()
