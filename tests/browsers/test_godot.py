# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects shaders/godot: by it each renderer of Godot plays files of the golden set as that has them."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import read_glb
from conftest import REPOSITORY, sinew
from test_shaders import GOLDEN, Mesh
from test_three import write

VERTEX, BONES, WEIGHTS = 0, 10, 11
KINDS = {VERTEX: "<f4", BONES: "<i4", WEIGHTS: "<f4"}
PROJECT = 'config_version=5\n[editor_plugins]\nenabled=PackedStringArray("res://addons/sinew/plugin.cfg")\n'
COMPATIBILITY = "--rendering-driver", "opengl3"
FORWARD, MOBILE = (
    ("--rendering-driver", "vulkan", "--rendering-method", method) for method in ("forward_plus", "mobile")
)
# Of normals Godot keeps 16 bits.
NORMALS = 2e-4


class Played:
    """A mesh as Godot has it: rest, points, normals [vertices, 3], bones, weights [vertices, 4 or 8]."""

    def __init__(self, folder, name, about, words):
        arrays = {number: np.fromfile(folder / f"{name}.{number}", kind) for number, kind in KINDS.items()}
        count, first = about["count"], about["first"]
        self.rest = arrays[VERTEX].reshape(count, 3)
        self.bones, self.weights = (arrays[number].reshape(count, -1) for number in (BONES, WEIGHTS))
        pixels = np.argsort(words[6])[np.searchsorted(np.sort(words[6]), first + 1 + np.arange(count))]
        assert np.all(words[6, pixels] == first + 1 + np.arange(count))
        self.points, self.normals = words[:3, pixels].T, words[3:6, pixels].T
        low, high = np.array(about["box"])
        assert np.all((self.points >= low) & (self.points <= high))


def levels_of(colours):
    """Which of sixteen steps each colour has; some renderers show them as sRGB."""
    steps = np.arange(16) / 15
    shown = [steps, np.where(steps <= 0.0031308, 12.92 * steps, 1.055 * steps ** (1 / 2.4) - 0.055)]
    found = [np.abs(np.arange(256)[:, None] - 255 * each) for each in shown]
    best = min(found, key=lambda each: each.min(axis=1)[colours].max())
    assert best.min(axis=1)[colours].max() <= 4
    return best.argmin(axis=1)[colours].astype(np.uint32)


class Project:
    """A project of Godot with the plugin."""

    def __init__(self, folder):
        self.folder, self.file = folder, folder / "human.glb"
        addon = folder / "addons/sinew"
        shutil.copytree(REPOSITORY / "shaders/godot", addon)
        shutil.copy(REPOSITORY / "shaders/sinew.glsl", addon / "sinew.gdshaderinc")
        shutil.copy(REPOSITORY / "tests/browsers/godot.gd", folder)
        (folder / "project.godot").write_text(PROJECT, encoding="utf-8")

    def run(self, *words):
        screen = [] if "DISPLAY" in os.environ else ["xvfb-run", "-a"]
        words = *screen, "godot", "--path", self.folder, "--audio-driver", "Dummy", *words
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False, timeout=600)
        said = done.stdout + done.stderr
        assert done.returncode == 0, said
        assert "SCRIPT ERROR" not in said, said
        assert "SHADER ERROR" not in said, said

    def play(self, renderer, time=1.0, method=(), is_imported=False):
        """Each mesh by the name of its node."""
        file = "res://human.glb" if is_imported else self.file
        if is_imported:
            self.run("--headless", "--import")
        out = self.folder / "out"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        self.run(*renderer, "--resolution", "256x256", "-s", "godot.gd", "--", file, time, out, *method)
        colours = np.array([np.fromfile(out / str(part), np.uint8) for part in range(21)])
        levels = levels_of(colours).reshape(7, 3, -1, 3)
        shifts = np.arange(0, 36, 4, dtype=np.uint64).reshape(3, 1, 3)
        bits = (levels.astype(np.uint64) << shifts).sum(axis=(1, 3), dtype=np.uint64)
        words = bits.astype(np.uint32).view(np.float32)
        about = json.loads((out / "about.json").read_text(encoding="utf-8"))
        return {name: Played(out, name, each, words) for name, each in about.items()}


@pytest.fixture
def project(tmp_path):
    if not all(map(shutil.which, ("godot", "xvfb-run"))):
        pytest.skip("no Godot 4: put a program `godot` on PATH, and install xvfb, to test in it")
    version = subprocess.run(["godot", "--version"], capture_output=True, text=True, check=True).stdout
    if not version.startswith("4."):
        pytest.skip(f"Godot {version.strip()}: shaders/godot is for Godot 4")
    return Project(tmp_path)


def of_file(file, played, mesh):
    """Where in the file each vertex is that Godot has."""
    attributes = file.header["meshes"][mesh]["primitives"][0]["attributes"]
    found = {point.tobytes(): k for k, point in enumerate(file.array(attributes["POSITION"]))}
    return np.array([found[point.tobytes()] for point in played.rest])


@pytest.mark.parametrize(
    ("case", "renderer", "influences", "is_imported"),
    [
        *[(path.stem, COMPATIBILITY, 4, False) for path in sorted(GOLDEN.glob("*.npz"))],
        ("weights", COMPATIBILITY, 8, True),
        ("twisted", FORWARD, 4, False),
        ("antipodal", MOBILE, 4, False),
    ],
)
def test_points_and_normals_are_golden(project, case, renderer, influences, is_imported):
    mesh = Mesh(GOLDEN / f"{case}.npz")
    results = write(mesh, project.file, influences)
    read, file = read_glb.points_at(project.file, [1.0]), read_glb.File(project.file)
    played = project.play(renderer, is_imported=is_imported)
    assert {result["array"] for result in results} == {*played}
    for number, result in enumerate(results):
        found = played[result["array"]]
        vertices = of_file(file, found, number)
        assert np.array_equal(np.sort(vertices), np.arange(len(mesh.points)))
        order = np.argsort(vertices)
        points, normals = found.points[order], found.normals[order]
        x, y, z = points.T
        assert np.abs(np.column_stack([x, -z, y]) - read[result["array"]][0]).max() <= mesh.tolerance, result
        mesh.assert_is(result, points)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        assert np.abs(normals - mesh.expected_normals(result)).max() <= NORMALS, result


def test_exported_files_and_what_godot_makes_of_their_weights(project):
    stages = "--set", "twist_spread=on", "--set", "bulge_limit=on", "--influences", "8"
    # Of these the former has vertices of more than four bones.
    human, shoulder = Path(os.environ.get("SINEW_RIGS", "/none"), "human.blend"), "blend_files/shoulder.blend"
    source = human if human.exists() else REPOSITORY / shoulder
    sinew("export", source, "--method", "cor", *stages, "--out", project.file)
    file = read_glb.File(project.file)
    ((name, expected),) = read_glb.points_at(project.file, [0.5]).items()
    (found,) = project.play(COMPATIBILITY, 0.5).values()
    vertices = of_file(file, found, 0)
    x, y, z = found.points.T
    diagonal = np.linalg.norm(np.ptp(found.rest, axis=0))
    error = np.abs(np.column_stack([x, -z, y]) - expected[0, vertices]).max()
    assert error <= 1e-5 * diagonal, name
    bones, weights = read_glb.influences(file, file.header["meshes"][0]["primitives"][0]["attributes"])
    np.testing.assert_array_equal(found.bones, bones[vertices])
    # Without the extension, by the method of the node, and by Godot's own weights.
    project.file.write_bytes(project.file.read_bytes().replace(b"SINEW_skinning", b"OTHER_skinning"))
    (own,) = project.play(COMPATIBILITY, 0.5, ["dq"]).values()
    sinew("export", source, "--method", "dq", "--influences", "8", "--out", project.file)
    (expected,) = read_glb.points_at(project.file, [0.5]).values()
    x, y, z = own.points.T
    error = np.abs(np.column_stack([x, -z, y]) - expected[0, of_file(file, own, 0)]).max()
    assert error <= 5e-5 * diagonal, name
    # In 65,535 steps, rounded down: sums may be below 1, which Godot's own skinning does not mend.
    steps = 65535 * weights[vertices] / weights[vertices].sum(axis=1, keepdims=True)
    lost = steps - 65535 * found.weights
    assert lost.min() > -0.01
    assert lost.max() < 1.01
    assert 65535 * found.weights.sum(axis=1).min() < 65534.5
