# SPDX-License-Identifier: GPL-3.0-or-later
"""Each fenced block of the documents is run or read by a test, and each picture is made by a program: new
ones must be listed here."""

from __future__ import annotations

import json
import re
import subprocess
from collections import Counter
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]

# (document, language of the block) -> their number, and the test that runs them as written.
# test_documented.py covers commands in indented blocks.
SNIPPETS = {
    ("docs/library.md", "python"): (1, "tests/python/test_readme.py"),
    ("docs/library.md", "cpp"): (1, "tests/native/consumer/test.cmake"),
    ("docs/batch.md", "toml"): (1, "tests/python/test_documented.py"),
    ("docs/batch.md", "yaml"): (1, "tests/blender/test_cluster.py"),
    ("docs/engines.md", "json"): (1, "tests/python/test_snippets.py"),
    ("docs/engines.md", "python"): (1, "tests/blender/test_export.py"),
    ("docs/flamenco.md", "yaml"): (1, "tests/python/test_snippets.py"),
    ("docs/render-tests.md", "text"): (1, "tests/blender/test_compare.py"),
    ("docs/render-tests.md", "python"): (1, "tests/blender/test_compare.py"),
}
NOT_RUN = {("docs/architecture.md", ""): "a drawing of a frame"}

# Pictures of docs/ -> the program that makes them, which contains their names or a prefix of them.
PICTURES = {
    r"(batch-report|heat|human|page|wrist|methods-\w+)\.png": ("docs/draw_sheets.py", None),
    r"comparison\.png": ("docs/photograph_comparison.py", None),
    r"(diagnostics|heat-map)\.png": ("docs/photograph_heat.py", None),
    r"panel\.png": ("docs/photograph_panel.py", None),
    r"panel-german\.webp": ("docs/photograph_panel.py", "language"),
    r"bake-error\.webp": ("docs/photograph_bake.py", None),
    r"motion-panel\.webp": ("docs/photograph_blend.py", "panel"),
    r"sculpt\.webp": ("docs/photograph_sculpt.py", "sculpt"),
    r"place-\w+\.webp": ("docs/photograph_places.py", "place-"),
    r"tour-[\w-]+\.webp": ("docs/photograph_tour.py", "tour-"),
    r"pictures-[\w-]+\.webp": ("docs/draw_methods.py", "pictures-"),
    r"motion-\w+\.(png|svg)": ("docs/draw_motion.py", None),
    r"cost-of-\w+\.svg": ("bench/plots.py", "cost-of-"),
    r"fits\.svg": ("bench/fits.py", None),
    r"ik\.svg": ("bench/ik.py", None),
    r"results-\w+\.svg": ("experiments/smith_2013/paper.py", None),
}


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


def test_every_fenced_block_is_known():
    found = Counter((name, language) for name in tracked("*.md") for language, _text in blocks(name))
    assert found == {key: count for key, (count, _test) in SNIPPETS.items()} | dict.fromkeys(NOT_RUN, 1)


@pytest.mark.parametrize(("key", "test"), [(key, test) for key, (_count, test) in SNIPPETS.items()])
def test_what_runs_a_block_reads_it(key, test):
    document, language = key
    text = (ROOT / test).read_text(encoding="utf-8")
    assert Path(document).name in text
    assert re.search(rf"```[\w(?:|]*{language}", text) or test.endswith("test_snippets.py")


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


def test_every_picture_is_made_by_a_program():
    pictures = [Path(name) for name in tracked("*.png", "*.webp", "*.svg", "*.jpg", "*.gif")]
    unused = set(PICTURES)
    for picture in pictures:
        assert picture.parent.as_posix() == "docs", picture
        fitting = [pattern for pattern in PICTURES if re.fullmatch(pattern, picture.name)]
        assert fitting, f"nothing here says what makes {picture}"
        unused -= set(fitting)
        program, named = PICTURES[fitting[0]]
        text = (ROOT / program).read_text(encoding="utf-8")
        assert (named or picture.name) in text, picture
    assert not unused


def test_every_picture_is_shown():
    pages = "".join((ROOT / name).read_text(encoding="utf-8") for name in tracked("*.md"))
    for name in tracked("docs/*.png", "docs/*.webp", "docs/*.svg"):
        assert f"({Path(name).name})" in pages or f"({name})" in pages, name
