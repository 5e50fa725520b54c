# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the names of the platforms that tools/cross_build.py builds for, and its wheels."""

from __future__ import annotations

import base64
import hashlib
import importlib.metadata
import re
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import cross_build  # noqa: E402
import package  # noqa: E402
from platforms import PLATFORMS  # noqa: E402

HEADERS = Path(sysconfig.get_path("include"))
PYCONFIG = (ROOT / "cmake/python/pyconfig.h").read_text(encoding="utf-8")


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
