# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects examples of other programs' files in the documents, and that every picture is shown."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]


def tracked(*patterns: str) -> list[str]:
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    listed = subprocess.run(
        ["git", "ls-files", *patterns], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return listed.stdout.splitlines()


def blocks(document: str) -> list[tuple[str, str]]:
    """(language, text) of each block."""
    text = (ROOT / document).read_text(encoding="utf-8")
    return re.findall(r"^ *```(\S*)\n(.*?)^ *```$", text, re.MULTILINE | re.DOTALL)


def test_the_mesh_in_gltf():
    (text,) = [text for language, text in blocks("docs/engines.md") if language == "json"]
    (mesh,) = json.loads("{" + text + "}")["meshes"]
    writer = (ROOT / "addon/features/gltf/export.py").read_text(encoding="utf-8")
    (primitive,) = mesh["primitives"]
    own = [name for name in primitive["attributes"] if name.startswith("_")]
    assert own
    for name in (*mesh["extras"], *mesh["extras"]["sinew"], *own):
        assert f'"{name}"' in writer, name


def test_the_variables_of_flamenco():
    (text,) = [text for language, text in blocks("docs/flamenco.md") if language == "yaml"]
    variables = yaml.safe_load(text)["variables"]
    (script,) = (ROOT / name for name in tracked("farm/**/*.js"))
    for name, variable in variables.items():
        assert "{" + name + "}" in script.read_text(encoding="utf-8")
        assert {value["platform"] for value in variable["values"]} <= {"linux", "windows", "darwin"}
        assert all(value["value"] for value in variable["values"])


# --- Pictures


def test_every_picture_is_shown():
    pages = "".join((ROOT / name).read_text(encoding="utf-8") for name in tracked("*.md"))
    for name in tracked("docs/*.png", "docs/*.webp", "docs/*.svg"):
        assert f"({Path(name).name})" in pages or f"({name})" in pages, name
