# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what is shipped: wheels and zips for each platform, which have every module, and their bill of
materials, compared with the module itself and with the schema of CycloneDX."""

from __future__ import annotations

import base64
import hashlib
import importlib.metadata
import json
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import cross_build
import package
import pytest
import sbom
import sinew._native
from platforms import PLATFORMS

ROOT = Path(__file__).resolve().parents[2]
HEADERS = Path(sysconfig.get_path("include"))
PYCONFIG = (ROOT / "native/cmake/python/pyconfig.h").read_text(encoding="utf-8")


def test_the_lists_of_platforms_agree():
    assert set(PLATFORMS) == package.ALL_PLATFORMS
    assert all(name == platform.name for name, platform in PLATFORMS.items())
    workflow = (ROOT / ".github/workflows/wheels.yml").read_text(encoding="utf-8")
    assert len(re.findall(r"- \{os: ", workflow)) == len(PLATFORMS) - 1  # all but Windows on arm64


@pytest.mark.skipif(sys.platform == "win32", reason="Python has no such values there")
def test_pyconfig_agrees_with_this_python():
    own = sysconfig.get_config_vars()
    unix = re.sub(r"#ifdef _WIN32\n.*?(#else|#endif)\n", "", PYCONFIG, flags=re.DOTALL)
    said = {name: int(value) for name, value in re.findall(r"^#define (\w+) (\d+)$", unix, re.MULTILINE)}
    assert said["SIZEOF_LONG"] == 8
    assert len(said) > 20
    # Newer versions of Python no longer call some of them.
    assert {name: own[name] for name in said if name in own} == {n: v for n, v in said.items() if n in own}
    assert len(said.keys() - own.keys()) <= 3


def test_the_names_that_pythons_library_exports_are_found():
    names = cross_build.exported_names(HEADERS)
    assert len(names) > 1000
    assert names["PyObject_CallObject"] is False
    assert names["PyExc_ValueError"] is True
    assert names["_Py_NoneStruct"] is True
    assert not [name for name in names if not re.match(r"_?_?Py", name)]


def test_a_wheel_is_whole_and_always_the_same(tmp_path):
    module = tmp_path / "_native.cp311-win_amd64.pyd"
    module.write_bytes(b"a module")
    described = {
        "METADATA": (importlib.metadata.distribution("sinew-skinning").read_text("METADATA")).encode()
    }
    tag = PLATFORMS["windows-x64"].wheel_tag("3.11")
    first = cross_build.write_wheel(module, tag, described, tmp_path / "first")
    again = cross_build.write_wheel(module, tag, described, tmp_path / "again")
    assert first.read_bytes() == again.read_bytes()
    with zipfile.ZipFile(first) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    (record,) = (name for name in files if name.endswith("/RECORD"))
    lines = [line.rsplit(",", 2) for line in files[record].decode().splitlines()]
    assert {name for name, _, _ in lines} == set(files)
    for name, digest, size in lines:
        if name != record:
            expected = base64.urlsafe_b64encode(hashlib.sha256(files[name]).digest()).rstrip(b"=").decode()
            assert (digest, size) == (f"sha256={expected}", str(len(files[name])))
    installed = {
        str(path)
        for path in importlib.metadata.distribution("sinew-skinning").files
        if path.parts[0] == "sinew"
    }
    compiled = re.compile(r".*(\.so|\.pyd|\.dll|\.dylib|\.pyc)")
    ours = {name for name in files if name.startswith("sinew/")}
    assert {n for n in installed if not compiled.fullmatch(n)} == ours - {f"sinew/{module.name}"}


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


ADDON = ROOT / "addon"


def test_the_wheel_has_every_module(tmp_path):
    # A copy: setuptools builds within the sources, and includes leftovers in the next wheel.
    sources = shutil.copytree(
        ADDON, tmp_path / "addon", ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info")
    )
    code = f"import setuptools.build_meta as m; m.build_wheel({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-I", "-c", code], cwd=sources, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    inside = {name for name in zipfile.ZipFile(wheel).namelist() if not re.match(r"[^/]+\.dist-info/", name)}
    modules = {path.relative_to(ADDON).as_posix() for path in ADDON.rglob("*.py")}
    assert len(modules) > 100
    files = modules - {"setup.py"} | {
        "blender_manifest.toml",
        "lesson.blend",
        "manual.html",
        "translations/de.po",
        "features/pages/page.html",
        "features/gltf/players.json",
        "jobs/report.html",
        *(path.relative_to(ADDON).as_posix() for path in ADDON.glob("features/pages/web/*")),
        *(f"ui/pictures/{method.name}.png" for method in sinew.methods()),
    }
    assert inside == {f"sinew_addon/{name}" for name in files}
