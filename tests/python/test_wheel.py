# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the wheel of sinew-blender: it contains every module; tests/installed runs its content."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import sinew

ADDON = Path(__file__).resolve().parents[2] / "addon"


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
        "core/templates/page.html",
        "core/templates/report.html",
        *(path.relative_to(ADDON).as_posix() for path in ADDON.glob("core/templates/viewer/*")),
        *(f"ui/pictures/{method.name}.png" for method in sinew.methods()),
    }
    assert inside == {f"sinew_addon/{name}" for name in files}
