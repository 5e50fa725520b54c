# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev corpus`: each file is a row, also one that can not be read; another shape than Blender's is a
failure."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
import corpus
import pytest
import scenes


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    scenes.make_arm(sides=6, rings=9)
    below = tmp_path / "files" / "below"
    below.mkdir(parents=True)
    scenes.save(below / "arm.blend")
    (below / "broken.glb").write_bytes(b"glTF and nothing else")
    (below / "notes.txt").write_text("no scene")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add()
    scenes.save(below / "cube.blend")
    return below.parent


@pytest.mark.once
@pytest.mark.slow
def test_each_file_is_a_row(folder, tmp_path):
    words = [sys.executable, corpus.__file__, str(folder), "--json", str(tmp_path / "rows.json")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    arm, broken, cube = json.loads((tmp_path / "rows.json").read_text())
    assert arm["by"] == ["evaluation"]
    assert 0.0 < max(arm["worst"].values()) < scenes.TOLERANCE
    assert arm["failures"] == cube["failures"] == []
    assert cube["meshes"] == 0
    assert "can not read it" in broken["error"]
    assert "3 files, 1 that Blender can not read; 1 with skins that Sinew deforms" in done.stdout
